// Both pages: questions to the server, parts of the page that it answers with, and the texts of studies.
"use strict";

const part = (id) => document.getElementById(id);

function say(text, path) {
  part("message").textContent = text;
  part("message").hidden = !text;
  document.querySelectorAll("[aria-invalid]").forEach((field) => field.removeAttribute("aria-invalid"));
  if (text && path) {
    document.querySelectorAll(`[name="${CSS.escape(path)}"]:not([type="range"])`).forEach((field) => field.setAttribute("aria-invalid", "true"));
  }
}

async function ask(address, body) {
  const json = !(body instanceof Blob), type = json ? "application/json" : "application/octet-stream";
  const options = body ? { method: "POST", headers: { "Content-Type": type }, body: json ? JSON.stringify(body) : body } : {};
  let answer;
  try {
    answer = await fetch(address, options);
  } catch {
    say("toppling app has ended; start it again.");
    return null;
  }
  const object = (answer.headers.get("Content-Type") || "").startsWith("application/json");
  const found = object ? await answer.json() : { said: await answer.text() };
  if (answer.ok) return found;
  say(found.said, found.path);
  return null;
}

function fill(parts) {
  const open = [...document.querySelectorAll("details[open] > summary")].map((summary) => summary.textContent);
  for (const [id, html] of Object.entries(parts)) {
    const focus = part(id).contains(document.activeElement) ? document.activeElement : null;
    const kept = focus && { id: focus.id, name: focus.getAttribute("data-for") };
    part(id).innerHTML = html;
    if (!kept) continue;
    const again = kept.id ? part(kept.id) : document.querySelector(`[data-for="${kept.name}"]`);
    if (again) again.focus();
  }
  document.querySelectorAll("details > summary").forEach((summary) => {
    if (open.includes(summary.textContent)) summary.parentNode.open = true;
  });
}

document.addEventListener("click", async (event) => {
  const button = event.target.closest("button");
  if (!button) return;
  if (button.id === "copy") await navigator.clipboard.writeText(part("text").textContent);
  if (button.classList.contains("show")) {
    if (button.dataset.which) part("which").value = button.dataset.which;
    const answer = await fetch(`${button.dataset.from}/${part("which").value}`);
    const json = (answer.headers.get("Content-Type") || "").startsWith("application/json");
    if (!answer.ok) { say(json ? (await answer.json()).said : await answer.text()); return; }
    part("text").textContent = await answer.text();
    part("text").hidden = part("copy").hidden = false;
    if (button.dataset.which) part("text").focus();
  }
});
