// A click enlarges a picture that does not change. The wheel or two fingers zoom it, and dragging moves it.
const dialog = document.querySelector("dialog");
let view, home, pointers = new Map();
const show = () => dialog.querySelector("svg").setAttribute("viewBox", view.join(" "));
function zoom(factor, x, y) {
  const box = dialog.querySelector("svg").getBoundingClientRect();
  const scale = Math.max(view[2] / box.width, view[3] / box.height);
  const px = view[0] + view[2] / 2 + (x - box.left - box.width / 2) * scale;
  const py = view[1] + view[3] / 2 + (y - box.top - box.height / 2) * scale;
  view = [px + (view[0] - px) * factor, py + (view[1] - py) * factor, view[2] * factor, view[3] * factor];
  show();
}
for (const button of document.querySelectorAll("button.open")) button.addEventListener("click", () => {
  dialog.querySelector("svg")?.remove();
  const svg = button.querySelector("svg").cloneNode(true);
  // the names of the clip paths refer to the small picture, which stays in the page
  dialog.prepend(svg);
  home = svg.getAttribute("viewBox").split(" ").map(Number);
  view = [...home];
  pointers.clear();
  dialog.showModal();
});
dialog.querySelector(".close").addEventListener("click", () => dialog.close());
dialog.addEventListener("wheel", (e) => { e.preventDefault(); zoom(Math.exp(e.deltaY / 500), e.clientX, e.clientY); },
  { passive: false });
dialog.addEventListener("dblclick", () => { view = [...home]; show(); });
dialog.addEventListener("pointerdown", (e) => { if (e.target.closest("svg")) pointers.set(e.pointerId, e); });
for (const name of ["pointerup", "pointercancel"]) dialog.addEventListener(name, (e) => pointers.delete(e.pointerId));
dialog.addEventListener("pointermove", (e) => {
  const last = pointers.get(e.pointerId);
  if (!last) return;
  const others = [...pointers.values()].filter((other) => other.pointerId !== e.pointerId);
  pointers.set(e.pointerId, e);
  if (others.length) {
    const apart = (one) => Math.hypot(one.clientX - others[0].clientX, one.clientY - others[0].clientY);
    zoom(apart(last) / Math.max(apart(e), 1), others[0].clientX, others[0].clientY);
  } else {
    const box = dialog.querySelector("svg").getBoundingClientRect();
    const scale = Math.max(view[2] / box.width, view[3] / box.height);
    view = [view[0] - (e.clientX - last.clientX) * scale, view[1] - (e.clientY - last.clientY) * scale, view[2], view[3]];
    show();
  }
});
