
(function () {
  const one = (id) => document.getElementById(id);
  const canvas = one("canvas");
  const stage = one("stage");
  const context = canvas.getContext("2d");
  // The newest picture, its status, and how they are shown.
  let image = null;
  let status = null;
  let zoom = null;
  let pointer = null;
  let chosen = false;
  let gone = false;

  const sleep = (ms) => new Promise((resume) => setTimeout(resume, ms));
  const seen = () =>
    document.visibilityState === "visible"
      ? Promise.resolve()
      : new Promise((resume) =>
          document.addEventListener("visibilitychange", resume, { once: true })
        ).then(seen);

  function view() {
    return document.querySelector("[name=view]:checked").value;
  }

  function paint() {
    const error = view() === "error";
    one("scale").hidden = !error;
    document.querySelectorAll(".of-picture").forEach((part) => (part.hidden = error));
    one("stops").value = (one("exposure").value > 0 ? "+" : "") + one("exposure").value + " EV";
    one("empty").hidden = image !== null && !(error && !image.errors);
    canvas.hidden = !one("empty").hidden;
    one("empty").textContent = image === null ? "No picture yet." : "Errors are not known yet.";
    if (canvas.hidden) {
      return;
    }
    if (canvas.width !== image.width || canvas.height !== image.height) {
      canvas.width = image.width;
      canvas.height = image.height;
      stage.style.aspectRatio = `${image.width} / ${image.height}`;
    }
    if (error) {
      draw.errors(context, image);
    } else {
      draw.picture(context, image, Number(one("exposure").value), one("tonemap").value);
    }
    place();
    read();
  }

  // The scale at which all of the picture is seen.
  function fit() {
    const [w, h] = [stage.clientWidth / image.width, stage.clientHeight / image.height];
    return Math.min(w, h);
  }

  function place() {
    if (image === null) {
      return;
    }
    const scale = zoom === null ? fit() : zoom;
    canvas.style.width = image.width * scale + "px";
    canvas.style.height = image.height * scale + "px";
    stage.classList.toggle("pixels", scale > 1);
  }

  // The pixel under (x, y) of the stage stays where it is.
  function zoomTo(next, x = stage.clientWidth / 2, y = stage.clientHeight / 2) {
    if (image === null) {
      return;
    }
    const before = zoom === null ? fit() : zoom;
    const box = canvas.getBoundingClientRect();
    const area = stage.getBoundingClientRect();
    const [px, py] = [(area.left + x - box.left) / before, (area.top + y - box.top) / before];
    zoom = next === null ? null : Math.min(Math.max(next, 1 / 16), 64);
    place();
    if (zoom !== null) {
      stage.scrollLeft = px * zoom - x;
      stage.scrollTop = py * zoom - y;
    }
  }

  const digits = (v) => Number(v.toPrecision(4)).toString();

  // Says what is under the pointer.
  function read() {
    if (image === null || pointer === null) {
      return;
    }
    const box = canvas.getBoundingClientRect();
    const x = Math.floor(((pointer[0] - box.left) / box.width) * image.width);
    const y = Math.floor(((pointer[1] - box.top) / box.height) * image.height);
    if (x < 0 || y < 0 || x >= image.width || y >= image.height) {
      return;
    }
    const i = y * image.width + x;
    const values = (table) => [0, 1, 2].map((c) => digits(table[3 * i + c]));
    const [r, g, b] = values(image.pixels);
    const at = [image.x + x * image.step, image.y + y * image.step];
    let text = `Pixel ${at[0]}, ${at[1]}: red ${r}, green ${g}, blue ${b}`;
    if (image.step > 1) {
      text += ` (mean of ${image.step} x ${image.step})`;
    }
    if (image.errors) {
      const [er, eg, eb] = values(image.errors);
      const part = draw.percent(draw.relative(image, i));
      text += `; standard error ${er}, ${eg}, ${eb} (${part})`;
    }
    one("value").textContent = text;
  }

  // Errors do not come with every picture: those of the picture before it stay.
  function unpack(buffer, before) {
    const [number, width, height, step, x, y, judged] = new Uint32Array(buffer, 0, 7);
    const count = 3 * width * height;
    const same = before !== null && before.width === width && before.height === height;
    const errors = judged
      ? new Float32Array(buffer, 28 + 4 * count, count)
      : same
        ? before.errors
        : null;
    const pixels = new Float32Array(buffer, 28, count);
    return { number, width, height, step, x, y, pixels, errors };
  }

  // The next error that has a name, as the program's last line has it.
  function goal() {
    const { target, errors } = status;
    if (target !== null) {
      return { error: target, name: `target ${draw.percent(target)}` };
    }
    const last = errors.length > 0 ? errors[errors.length - 1][1] : Infinity;
    const names = [[0.2, "draft"], [0.05, "good"], [0.01, "final"]];
    const next = names.find(([error]) => last > error);
    return next ? { error: next[0], name: `${draw.percent(next[0])} (${next[1]})` } : null;
  }

  function tell() {
    const { scene, integrator, phase, part, text, errors, ended, stopping } = status;
    const whole = Math.round(100 * part);
    document.title = `${whole} % ${scene} - Phalanx`;
    one("scene").textContent = scene || "Phalanx";
    one("phase").textContent = ended === null ? `${integrator || ""} ${phase} ${whole} %` : "";
    one("rate").textContent = ended === null && text ? `at ${text}` : "";
    one("bar").setAttribute("aria-valuenow", whole);
    one("bar").firstElementChild.style.width = 100 * part + "%";
    const news = ended !== null ? ended : stopping ? "Stopping: the picture is being written." : "";
    one("news").textContent = gone && ended === null
      ? "No answer: the render has ended, or its machine cannot be reached."
      : news;
    one("news").hidden = one("news").textContent === "";
    one("stop").hidden = ended !== null || gone;
    one("stop").disabled = stopping;
    const items = status.warnings.map((warning) => {
      const item = document.createElement("li");
      item.textContent = warning;
      return item;
    });
    one("warnings").replaceChildren(...items);
    const next = goal();
    draw.chart(one("chart"), errors, next);
    one("forecast").textContent = forecast(errors, next);
  }

  function forecast(errors, next) {
    if (!status.judged) {
      return "The error of this render is not estimated.";
    }
    if (errors.length === 0) {
      return "The error is not known yet.";
    }
    const [seconds, error] = errors[errors.length - 1];
    const now = `${draw.percent(error)} after ${draw.time(seconds)}`;
    if (next === null || error <= next.error || status.ended !== null) {
      return now;
    }
    const more = seconds * ((error / next.error) ** 2 - 1);
    return `${now}; ${next.name} in about ${draw.time(more)} more`;
  }

  async function follow() {
    for (let failures = 0; ; ) {
      await seen();
      try {
        const reply = await fetch(`status?after=${status === null ? 0 : status.version}`);
        if (!reply.ok) {
          throw new Error(reply.statusText);
        }
        const first = status === null || status.scene === "";
        status = await reply.json();
        failures = 0;
        gone = false;
        // The page has the curves that treat channels alike.
        const has = [...one("tonemap").options].some((o) => o.value === status.tonemap);
        if (first && !chosen && has) {
          one("tonemap").value = status.tonemap;
          one("exposure").value = status.exposure === null ? 0 : status.exposure;
          paint();
        }
        tell();
        await sleep(400);
      } catch (error) {
        failures += 1;
        gone = failures > 2 || (status !== null && status.ended !== null);
        if (status !== null) {
          tell();
        }
        if (gone && status !== null && status.ended !== null) {
          return;
        }
        await sleep(Math.min(500 * failures, 5000));
      }
    }
  }

  async function look() {
    for (;;) {
      await seen();
      try {
        const reply = await fetch(`picture?after=${image === null ? 0 : image.number}`);
        const buffer = await reply.arrayBuffer();
        if (reply.ok && buffer.byteLength > 0) {
          const first = image === null;
          image = unpack(buffer, image);
          if (first && !chosen && status !== null && status.exposure === null) {
            one("exposure").value = draw.automatic(image).toFixed(1);
          }
          paint();
        }
        await sleep(200);
      } catch (error) {
        if (status !== null && status.ended !== null) {
          return;
        }
        await sleep(1000);
      }
    }
  }

  // Twice within some seconds: nobody means to end a night's work with one click.
  let armed = null;
  one("stop").addEventListener("click", async () => {
    const button = one("stop");
    if (armed === null) {
      armed = setTimeout(() => {
        armed = null;
        button.classList.remove("armed");
        button.textContent = "Stop and save";
      }, 5000);
      button.classList.add("armed");
      button.textContent = "Really stop?";
      return;
    }
    button.disabled = true;
    button.textContent = "Stop and save";
    button.classList.remove("armed");
    await fetch("stop", { method: "POST" });
  });

  const change = () => {
    chosen = true;
    paint();
  };
  one("exposure").addEventListener("input", change);
  one("tonemap").addEventListener("change", change);
  document.querySelectorAll("[name=view]").forEach((v) => v.addEventListener("change", paint));
  one("automatic").addEventListener("click", () => {
    if (image !== null) {
      one("exposure").value = draw.automatic(image).toFixed(1);
      change();
    }
  });
  const scale = () => (zoom === null ? fit() : zoom);
  one("in").addEventListener("click", () => zoomTo(scale() * 1.5));
  one("out").addEventListener("click", () => zoomTo(scale() / 1.5));
  one("fit").addEventListener("click", () => zoomTo(null));
  one("one").addEventListener("click", () => zoomTo(1));
  stage.addEventListener("keydown", (event) => {
    const keys = { "+": () => scale() * 1.5, "=": () => scale() * 1.5, "-": () => scale() / 1.5 };
    keys["0"] = () => null;
    keys["1"] = () => 1;
    if (event.key in keys && image !== null) {
      event.preventDefault();
      zoomTo(keys[event.key]());
    }
  });
  stage.addEventListener(
    "wheel",
    (event) => {
      if (image === null || event.target !== canvas) {
        return;
      }
      event.preventDefault();
      const area = stage.getBoundingClientRect();
      const next = scale() * Math.exp(-event.deltaY / 400);
      zoomTo(next, event.clientX - area.left, event.clientY - area.top);
    },
    { passive: false }
  );

  // Drag what does not fit; fingers scroll by themselves.
  let from = null;
  stage.addEventListener("pointerdown", (event) => {
    if (event.pointerType === "mouse" && event.button === 0) {
      from = [event.clientX + stage.scrollLeft, event.clientY + stage.scrollTop];
      stage.classList.add("dragged");
    }
  });
  window.addEventListener("pointerup", () => {
    from = null;
    stage.classList.remove("dragged");
  });
  stage.addEventListener("pointermove", (event) => {
    if (from !== null) {
      stage.scrollLeft = from[0] - event.clientX;
      stage.scrollTop = from[1] - event.clientY;
    }
  });
  for (const kind of ["pointermove", "pointerdown"]) {
    canvas.addEventListener(kind, (event) => {
      pointer = [event.clientX, event.clientY];
      read();
    });
  }

  window.addEventListener("resize", () => {
    place();
    if (status !== null) {
      tell();
    }
  });
  one("ramp").style.background = draw.ramp();
  paint();
  follow();
  look();
})();
