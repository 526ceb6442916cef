window.addEventListener("load", () => {
  const verdict = { errors: window.seen };
  const all = (selector) => [...document.querySelectorAll(selector)];
  const one = (selector) => document.querySelector(selector);
  const fire = (target, type, place) => {
    const settings = { bubbles: true, clientX: place?.[0], clientY: place?.[1], buttons: place?.[2] ?? 0 };
    target.dispatchEvent(new PointerEvent(type, settings));
  };
  try {
    verdict.series = all(".chart .series").length;
    verdict.points = all(".chart .point").length;
    verdict.legends = all(".chart .legend").length;
    verdict.chart_width = one(".chart").getBoundingClientRect().width;
    const pictures = all(".gallery img");
    verdict.pictures = pictures.length;
    verdict.broken = all("img").filter((p) => !p.complete || p.naturalWidth === 0).length;
    verdict.sizes = [...new Set(pictures.map((p) => `${p.naturalWidth}x${p.naturalHeight}`))];

    const tip = one("#tip");
    verdict.tip_hidden_at_first = tip.hidden;
    const point = one(".point");
    const box = point.querySelector("polygon").getBoundingClientRect();
    fire(one(".chart"), "pointermove", [box.left + box.width / 2, box.top + box.height / 2]);
    verdict.tip_shows_the_point = !tip.hidden && tip.textContent === point.dataset.tip && tip.offsetWidth > 50;
    verdict.others_fade = one(".chart").classList.contains("focus") && all(".series.on").length === 1;
    fire(one(".chart"), "pointerleave");
    verdict.tip_leaves = tip.hidden && all(".on").length === 0;

    const [stage, over, under, divider] = [".stage", ".over", ".under", ".divider"].map(one);
    const [slider, right, flip] = [".slider", ".right", ".flip"].map(one);
    const hidden = () => over.style.clipPath.match(/inset\(0(?:px)? ([\d.]+)%/)?.[1];
    verdict.starts_in_the_middle = hidden() === "50" && divider.style.left === "50%";
    slider.value = 25;
    slider.dispatchEvent(new Event("input", { bubbles: true }));
    verdict.slider_moves_the_divider = hidden() === "75" && divider.style.left === "25%";
    const area = stage.getBoundingClientRect();
    fire(stage, "pointermove", [area.left + 0.6 * area.width, area.top + 5, 1]);
    verdict.dragging_moves_the_slider = Math.abs(slider.value - 60) < 1 && Math.abs(hidden() - 40) < 1;
    const before = under.src;
    right.selectedIndex = 0;
    right.dispatchEvent(new Event("change", { bubbles: true }));
    verdict.choosing_changes_the_picture = under.src !== before && under.src === pictures[0].src;

    const [slide, turn] = all(".mode");
    turn.click();
    verdict.flip_shows_one = hidden() === "0" && slider.disabled && !flip.disabled;
    const name = one(".tag-left").textContent;
    flip.click();
    verdict.flip_shows_the_other = hidden() === "100";
    verdict.flip_names_what_it_shows = one(".tag-left").textContent === "Reference" && name !== "Reference";
    slide.click();
    verdict.sliding_again = Math.abs(hidden() - 40) < 1 && flip.disabled;
  } catch (error) {
    verdict.errors.push(String(error));
  }
  const out = document.createElement("pre");
  out.id = "verdict";
  out.textContent = JSON.stringify(verdict);
  document.body.append(out);
});
