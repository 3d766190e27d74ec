// The stage: any two pictures of a scene over one another. The pictures themselves are those of the strip below it.
"use strict";
document.documentElement.classList.add("js");

for (const viewer of document.querySelectorAll(".viewer")) {
  const shots = [...viewer.closest("section").querySelectorAll(".shot")];
  const stage = viewer.querySelector(".stage");
  const handle = viewer.querySelector(".handle");
  const maps = viewer.querySelector(".maps");
  const pickers = { left: viewer.querySelector("select.left"), right: viewer.querySelector("select.right") };
  let timer = 0;

  function show() {
    for (const [name, picker] of Object.entries(pickers)) {
      const shot = shots[picker.value];
      const side = stage.querySelector(".side." + name);
      const image = (maps.checked && shot.querySelector("img.errors")) || shot.querySelector("img.shown");
      const text = picker.selectedOptions[0].textContent;
      side.querySelector("img").src = image.src;
      side.querySelector("img").alt = image.alt;
      side.querySelector("span").textContent = text;
    }
    for (const shot of shots) {
      shot.classList.toggle("staged", [pickers.left.value, pickers.right.value].includes(shot.dataset.index));
    }
  }

  function wipeTo(percent) {
    const at = Math.min(100, Math.max(0, percent));
    stage.style.setProperty("--at", at + "%");
    handle.setAttribute("aria-valuenow", Math.round(at));
  }

  function setMode(mode) {
    clearInterval(timer);
    stage.classList.remove("flipped");
    stage.dataset.mode = mode;
    for (const button of viewer.querySelectorAll(".modes button")) {
      button.setAttribute("aria-pressed", button.dataset.mode === mode);
    }
    if (mode === "flicker") {
      timer = setInterval(() => stage.classList.toggle("flipped"), 600);
    }
  }

  const follow = (event) => {
    const box = stage.getBoundingClientRect();
    wipeTo((100 * (event.clientX - box.left)) / box.width);
  };
  stage.addEventListener("pointerdown", (event) => {
    if (stage.dataset.mode !== "wipe") return;
    event.preventDefault();
    handle.focus({ preventScroll: true });
    stage.setPointerCapture(event.pointerId);
    follow(event);
  });
  stage.addEventListener("pointermove", (event) => {
    if (stage.hasPointerCapture(event.pointerId)) follow(event);
  });

  const steps = { ArrowLeft: -2, ArrowDown: -2, ArrowRight: 2, ArrowUp: 2, PageDown: -10, PageUp: 10, Home: -100, End: 100 };
  handle.addEventListener("keydown", (event) => {
    if (!(event.key in steps)) return;
    event.preventDefault();
    wipeTo(Number(handle.getAttribute("aria-valuenow")) + steps[event.key]);
  });

  for (const button of viewer.querySelectorAll(".modes button")) {
    button.addEventListener("click", () => setMode(button.dataset.mode));
  }
  for (const shot of shots) {
    shot.querySelector("button").addEventListener("click", () => {
      pickers.left.value = shot.dataset.index;
      show();
      viewer.scrollIntoView({ block: "nearest", behavior: "smooth" });
    });
  }
  for (const control of [maps, pickers.left, pickers.right]) control.addEventListener("change", show);
  wipeTo(50);
  show();
}

// Paper cannot unfold what is folded.
const folded = [];
addEventListener("beforeprint", () => {
  for (const details of document.querySelectorAll("details:not([open])")) {
    details.open = true;
    folded.push(details);
  }
});
addEventListener("afterprint", () => {
  for (const details of folded.splice(0)) details.open = false;
});
