"use strict";

// Values under the pointer: the nearest point of the chart, within a thumb's reach.
(function () {
  const REACH = 28;
  const tip = document.getElementById("tip");

  function focus(chart, series) {
    chart.classList.toggle("focus", series !== null);
    for (const part of chart.querySelectorAll("[data-series]")) {
      part.classList.toggle("on", part.dataset.series === series);
    }
  }

  function point(chart, event) {
    const box = chart.getBoundingClientRect();
    const scale = box.width / chart.viewBox.baseVal.width;
    const x = (event.clientX - box.left) / scale;
    const y = (event.clientY - box.top) / scale;
    let nearest = null;
    let least = REACH;
    for (const candidate of chart.querySelectorAll(".point")) {
      const distance = Math.hypot(candidate.dataset.x - x, candidate.dataset.y - y);
      if (distance < least) {
        least = distance;
        nearest = candidate;
      }
    }
    return nearest;
  }

  function show(chart, nearest) {
    for (const other of chart.querySelectorAll(".point.on")) {
      other.classList.remove("on");
    }
    tip.hidden = nearest === null;
    if (nearest === null) {
      return focus(chart, null);
    }
    nearest.classList.add("on");
    focus(chart, nearest.closest(".series").dataset.series);
    tip.textContent = nearest.dataset.tip;
    const box = chart.getBoundingClientRect();
    const scale = box.width / chart.viewBox.baseVal.width;
    const left = box.left + nearest.dataset.x * scale + 14;
    const top = box.top + nearest.dataset.y * scale - tip.offsetHeight - 10;
    const most = document.documentElement.clientWidth - tip.offsetWidth - 4;
    tip.style.left = Math.max(0, Math.min(left, most)) + window.scrollX + "px";
    tip.style.top = Math.max(0, top) + window.scrollY + "px";
  }

  for (const chart of document.querySelectorAll(".chart")) {
    // The browser's own tips would cover ours.
    chart.querySelectorAll("title").forEach((title) => title.remove());
    chart.addEventListener("pointermove", (event) => show(chart, point(chart, event)));
    chart.addEventListener("pointerleave", () => show(chart, null));
    for (const entry of chart.querySelectorAll(".legend")) {
      entry.addEventListener("pointermove", (event) => {
        event.stopPropagation();
        focus(chart, entry.dataset.series);
      });
      entry.addEventListener("pointerleave", () => focus(chart, null));
    }
  }
})();

// Two pictures in one place: a divider between them, or one after the other.
(function () {
  for (const compare of document.querySelectorAll(".compare")) {
    const find = (selector) => compare.querySelector(selector);
    const [stage, under, over, divider] = [".stage", ".under", ".over", ".divider"].map(find);
    const [left, right, slider, flip] = [".left", ".right", ".slider", ".flip"].map(find);
    const [leftTag, rightTag] = [".tag-left", ".tag-right"].map(find);
    let flipped = false;

    function isFlip() {
      return find(".mode:checked").value === "flip";
    }

    function source(select) {
      return document.getElementById(select.value).src;
    }

    function name(select) {
      return select.selectedOptions[0].textContent;
    }

    function draw() {
      over.src = source(left);
      under.src = source(right);
      over.alt = name(left);
      under.alt = name(right);
      const at = Number(slider.value);
      const hidden = isFlip() ? (flipped ? 100 : 0) : 100 - at;
      over.style.clipPath = `inset(0 ${hidden}% 0 0)`;
      divider.style.left = at + "%";
      stage.classList.toggle("flip", isFlip());
      slider.disabled = isFlip();
      flip.disabled = !isFlip();
      leftTag.textContent = name(isFlip() && flipped ? right : left);
      rightTag.textContent = name(right);
    }

    function turn() {
      flipped = !flipped;
      draw();
    }

    function drag(event) {
      const box = stage.getBoundingClientRect();
      slider.value = (100 * (event.clientX - box.left)) / box.width;
      draw();
    }

    stage.addEventListener("pointerdown", (event) => {
      if (isFlip()) {
        turn();
      } else {
        stage.setPointerCapture(event.pointerId);
        drag(event);
      }
    });
    stage.addEventListener("pointermove", (event) => {
      if (!isFlip() && event.buttons % 2 === 1) {
        drag(event);
      }
    });
    flip.addEventListener("click", turn);
    slider.addEventListener("input", draw);
    for (const control of [left, right, ...compare.querySelectorAll(".mode")]) {
      control.addEventListener("change", () => {
        flipped = false;
        draw();
      });
    }
    draw();
  }
})();
