// The live page: each change is sent to the server, which answers with parts of the page.
"use strict";

const QUIET = 250; // ms without a change after which the full answer begins
let version = -1, busy = false, waiting = new Map(), playing = 0, resting = 0;

function put(parts) {
  const level = part("level") && part("level").value;
  fill(parts);
  if ("answer" in parts) {
    sight.disconnect();
    sight.observe(part("answer").querySelector("table"));
  }
  if ("curve" in parts) {
    if (level !== null && level !== undefined) part("level").value = level;
    mark();
  }
}

// (the short answer stands at the lower edge while the answer is out of sight)
const sight = new IntersectionObserver(([table]) => part("brief").classList.toggle("seen", table.isIntersecting));
const RANGES = ["answer", "brief", "curve"], REST = ["basis", "remedies", "variants"];

function older(is, ids = [...RANGES, ...REST]) {
  for (const id of ids) {
    part(id).setAttribute("aria-busy", is);
    part(id).classList.toggle("older", is);
  }
}

async function complete() {
  const wanted = version;
  for (const [stage, ids] of [["ranges", RANGES], ["rest", [...RANGES, ...REST]]]) {
    const found = await ask(`complete?version=${wanted}&stage=${stage}`);
    if (!found || found.superseded || wanted !== version) return;
    put(found.parts);
    older(false, ids);
    document.body.dataset[stage] = String(version);
  }
  document.body.dataset.complete = String(version);
}

async function send() {
  if (busy) return;
  busy = true;
  while (waiting.size) {
    const [path, value] = waiting.entries().next().value;
    waiting.delete(path);
    const began = performance.now();
    const file = value instanceof File;
    const found = await ask(file ? `hazard?name=${encodeURIComponent(value.name)}` : "change", file ? value : { path, value });
    if (!found) continue;
    say("");
    const changed = found.version !== version;
    version = found.version;
    put(found.parts);
    document.body.dataset.version = String(version);
    document.body.dataset.took = String(performance.now() - began);
    if (!changed) continue;
    older(true);
    RANGES.forEach((id) => part(id).classList.remove("older"));
    clearTimeout(resting);
    resting = setTimeout(complete, QUIET);
  }
  busy = false;
}

function change(path, value) {
  waiting.set(path, value);
  send();
}

function mark() {
  const k = Number(part("level").value);
  [...part("levels").children].forEach((sentence, i) => { sentence.hidden = i !== k; });
  const x = part("mark").dataset.places.trim().split(" ")[k];
  part("mark").setAttribute("x1", x);
  part("mark").setAttribute("x2", x);
  part("level").setAttribute("aria-valuetext", part("levels").children[k].textContent);
}

document.addEventListener("input", (event) => {
  const field = event.target;
  if (field.id === "level") mark();
  if (field.type !== "range" || !field.dataset.for) return;
  const text = Number(field.value).toPrecision(3);
  part(field.dataset.for).value = String(Number(text));
  change(field.name, String(Number(text)));
});

document.addEventListener("change", (event) => {
  const field = event.target;
  if (field.type === "file" && field.files.length) change("hazard", field.files[0]);
  if (!field.name || field.type === "range") return;
  const slider = document.querySelector(`[data-for="${field.id}"]`);
  if (slider) slider.value = field.value;
  change(field.name, field.type === "checkbox" ? (field.checked ? "yes" : "no") : field.value);
});

document.addEventListener("dragover", (event) => event.preventDefault());
document.addEventListener("drop", (event) => {
  event.preventDefault();
  if (event.dataTransfer.files.length) change("hazard", event.dataTransfer.files[0]);
});

async function play() {
  const found = await ask(`film?level=${part("level").value}&motion=${Number(part("motion").value) - 1}`);
  if (!found) return;
  say("");
  const [left, right, top] = found.view;
  const film = part("film");
  film.removeAttribute("hidden");
  film.scrollIntoView({ block: "nearest" });
  film.setAttribute("viewBox", `${left} ${-top} ${right - left} ${top + 0.12}`);
  film.innerHTML = `<g transform="scale(1 -1)"><g class="ground"><rect class="floor" x="${left - 5}" y="-0.1" width="${right - left + 10}" height="0.1"/>`
    + found.walls.map((x) => `<rect class="wall" x="${x < 0 ? x - 0.05 : x}" y="0" width="0.05" height="${top}"/>`).join("")
    + `</g><polygon class="piece"/><polyline class="strap"/></g>`;
  part("film-said").innerHTML = found.outcome;
  const ground = film.querySelector(".ground"), piece = film.querySelector(".piece"), tie = film.querySelector(".strap");
  const own = ++playing, began = performance.now(), last = found.boxes.length - 1;
  const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
  const draw = (k) => {
    piece.setAttribute("points", found.boxes[k].join(" "));
    tie.setAttribute("points", (found.ties[k] || []).join(" ")); // (none once it is broken)
    ground.setAttribute("transform", `translate(${found.floor[k]} 0)`);
  };
  const step = (now) => {
    if (own !== playing) return;
    const k = Math.min(last, Math.max(0, Math.floor((now - began) / 1000 * found.fps)));
    draw(k);
    film.dataset.frame = String(k);
    if (k < last) requestAnimationFrame(step);
  };
  if (still) draw(last); else requestAnimationFrame(step);
}

document.addEventListener("click", async (event) => {
  const link = event.target.closest('a[href^="#basis-"]');
  const basis = link && document.querySelector(link.getAttribute("href"));
  if (basis) basis.open = true;
  const button = event.target.closest("button");
  if (!button) return;
  if (button.id === "play") play();
  if (button.classList.contains("variant")) {
    const found = await ask("variant", { what: button.dataset.what });
    if (!found) return;
    say("");
    version = found.version;
    put(found.parts);
    document.body.dataset.version = String(version);
    older(true);
    complete();
  }
});

document.addEventListener("submit", async (event) => {
  event.preventDefault();
  if (event.target.id !== "save") return;
  const found = await ask("save", { name: part("name").value });
  part("saved").innerHTML = found ? found.said : "";
  if (found) say("");
});

(async () => {
  const found = await ask("begin");
  if (!found) return;
  version = found.version;
  put(found.parts);
  document.body.dataset.version = String(version);
  complete();
})();
