// A building full: cells, ticks and the budget are sent to the server; runs are watched until they end.
"use strict";

const WATCH = 400; // ms between two looks at running work
let seen = 0, looks = 0, shownProgress = "";

async function tell(path, value) {
  const answer = await ask("building/change", { path, value });
  if (answer) { say(""); fill(answer.parts); }
  look();
}

async function take(file) {
  if (!file) return;
  if (file.size > Number(part("file").dataset.most)) { say(`${file.name}: is too large for a table of pieces.`); return; }
  const answer = await ask(`building/drop?name=${encodeURIComponent(file.name)}`, file);
  if (answer) { say(""); fill(answer.parts); }
  part("file").value = "";
  look();
}

function show(answer) {
  const parts = answer.parts;
  if (parts.progress === shownProgress) delete parts.progress; else shownProgress = parts.progress;
  fill(parts);
  part("wrong").textContent = answer.wrong;
  for (const [id, is] of [["wrong", answer.wrong], ["stop", answer.running], ["go", answer.stopped]]) part(id).hidden = !is;
  const older = answer.running || answer.stopped || Boolean(answer.wrong);
  part("result").classList.toggle("older", older && part("result").textContent !== "");
  for (const id of ["result", "progress"]) part(id).setAttribute("aria-busy", answer.running);
  document.querySelectorAll("#sheet [aria-invalid]").forEach((field) => field.removeAttribute("aria-invalid"));
  if (!answer.cell) return;
  const at = part(`cell-${answer.cell}`), line = part(`line-${answer.cell.split("-")[0]}`);
  const fields = at ? [at] : line ? line.querySelectorAll("input") : [];
  fields.forEach((field) => { field.setAttribute("aria-invalid", "true"); field.setAttribute("aria-errormessage", "wrong"); });
  if (fields.length && seen !== answer.version) fields[0].scrollIntoView({ block: "nearest", inline: "center" });
}

async function look() {
  const number = ++looks;
  const answer = await ask(`building/state?version=${seen}`);
  if (!answer || number !== looks) return;
  show(answer);
  seen = answer.version;
  Object.assign(document.body.dataset, { version: seen, running: answer.running });
  if (answer.running) setTimeout(() => { if (number === looks) look(); }, WATCH);
}

document.addEventListener("input", (event) => {
  if (event.target.id === "budget") part("sum").value = String(Math.round(Number(event.target.value)));
});

document.addEventListener("change", (event) => {
  const field = event.target, path = field.dataset.path;
  if (field.id === "file") take(field.files[0]);
  if (!path) return;
  tell(path, field.type === "checkbox" ? (field.checked ? "yes" : "") : field.id === "budget" ? part("sum").value : field.value);
});

document.addEventListener("click", (event) => {
  const button = event.target.closest("button");
  if (button && button.dataset.path) tell(button.dataset.path, button.dataset.value || "");
  if (button && button.classList.contains("print")) {
    const report = window.open(`building/report/${button.dataset.which}`);
    if (report) report.addEventListener("load", () => report.print());
  }
});

document.addEventListener("dragover", (event) => event.preventDefault());
document.addEventListener("drop", (event) => { event.preventDefault(); take(event.dataTransfer.files[0]); });

look();
