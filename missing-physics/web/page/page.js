// The page: what is known of a recording, step by step, until it can be diagnosed.
(() => {
  const $ = (id) => document.getElementById(id);
  const { element } = columns;
  const text = (bytes) => new TextDecoder().decode(bytes);
  const bytes = (string) => new TextEncoder().encode(string);
  let known = null;
  // What was dropped: the recording's name, its files, its header where it has one; what somebody settled of the columns.
  let state = { domain: null, name: "", files: [], header: null, settled: null, maps: null };
  // What can be diagnosed, and the answer to it.
  let recording = null;
  let answer = null;
  let asked = 0;
  let typed = null;

  const say = (what, wrong = false) => {
    $("state").textContent = what;
    $("state").classList.toggle("wrong", wrong);
  };
  const complain = (error) => {
    $("failed").hidden = !error;
    $("failed").textContent = error ? error.message : "";
  };
  const here = (id) => known.domains.find((domain) => domain.id === id);
  const number = (id) => {
    const value = $(id).value.trim().replace(",", ".");
    return value === "" ? null : Number(value);
  };
  const key = (header, name) => header.match(new RegExp(`^\\s*${name}\\s*=\\s*"([^"]*)"`, "m"))?.[1];
  const isHeader = ([name]) => /\.toml$/i.test(name);
  const isMesh = ([name]) => /\.(stl|obj)$/i.test(name);
  const headers = () => state.files.filter(isHeader);
  const tables = () => state.files.filter((file) => !isHeader(file) && !isMesh(file));
  const meshes = () => state.files.filter(isMesh);
  // Whether the files are a recording already: a header was dropped, and all that it names.
  const whole = () => {
    if (headers().length === 0 || tables().length === 0) return false;
    const data = key(state.header, "data");
    const there = (name) => tables().some((file) => file[0] === name);
    return data ? there(data) : /^\s*\[audio\]/m.test(state.header);
  };

  const choose = (id) => {
    state.domain = id;
    for (const chip of $("domains").children) {
      chip.setAttribute("aria-checked", chip.value === id);
      chip.tabIndex = chip.value === id || id === null ? 0 : -1;
    }
    const domain = here(id);
    $("summary").textContent = domain?.summary ?? "";
    $("reads").hidden = !domain?.columns.length;
    const line = ({ name, what }) => element("li", {}, element("code", {}, name), `: ${what}`);
    $("columns").replaceChildren(...(domain?.columns ?? []).map(line));
  };

  // A machine's equations stand in its header: without one there is nothing to read its columns by.
  const headed = () => state.header ?? (state.domain === "motion" ? here("motion").template[0][1] : null);
  const showHeader = (header, open) => {
    $("rig").hidden = false;
    // What is being written is not written over.
    if (typed === null && document.activeElement !== $("header")) $("header").value = header;
    if (open) $("rig").open = true;
    $("again").hidden = state.header === null || headers().length > 0;
  };

  // Reads the recording that there is now, and says what is in it.
  const check = async (name, all) => {
    const { channels, runs, domain, hints } = await engine.ask("check", { name, files: all });
    const rows = runs.reduce((sum, run) => sum + run.rows, 0);
    const shown = (value) => String(Number(value.toPrecision(4)));
    const range = ({ name: of, unit, range: [low, high] }) => `${of} ${shown(low)} to ${shown(high)} ${unit}`.trim();
    const first = `${domain}: ${runs.length} run${runs.length === 1 ? "" : "s"}, ${rows} rows; ${channels.map(range).join(", ")}`;
    return { files: all, name, said: [first, ...hints.map((hint) => `Look at this: ${hint}`)].join("\n") };
  };
  const asRecording = async (mine) => {
    $("mapping").hidden = true;
    showHeader(state.header, false);
    try {
      return await check(state.name, [["recording.toml", bytes(state.header)], ...tables(), ...meshes()]);
    } catch (error) {
      // Columns by other names than the domain's are a laboratory's.
      if (!here(state.domain) || !/unknown column|column \S+ is missing/.test(error.message)) throw error;
      return asTables(mine);
    }
  };
  const asTables = async (mine) => {
    const wish = { domain: state.domain, header: headed(), maps: state.maps ?? [], gap_s: number("gap"), every: number("every"), rate_hz: number("rate") };
    const proposed = await engine.ask("propose", { wish, files: tables() });
    // Somebody has changed something since.
    if (mine !== asked) return null;
    const words = new Map(here(state.domain).columns.map(({ name, what }) => [name, what]));
    state.wanted = proposed.wanted;
    columns.show(proposed, words, state.settled);
    $("mapping").hidden = false;
    const { made, why } = proposed;
    const remarks = proposed.tables.flatMap((table) => table.remarks);
    $("notes").replaceChildren(...[...remarks, ...(made?.notes ?? [])].map((note) => element("li", {}, note)));
    if (!made) {
      if (headed() !== null) showHeader(headed(), state.domain === "motion");
      throw new Error(why);
    }
    showHeader(made.header, made.unknown.length > 0 || state.domain === "motion");
    const copies = tables().filter(([name]) => made.copies[name]).map(([name, content]) => [made.copies[name], content]);
    const table = made.table ? [[made.table[0], bytes(made.table[1])]] : [];
    return check(state.name, [["recording.toml", bytes(made.header)], ...table, ...copies, ...meshes()]);
  };

  // Brings all that depends on the state up to date; of several at once the last one counts.
  const update = async () => {
    asked += 1;
    const mine = asked;
    recording = null;
    $("diagnose").disabled = true;
    $("dropped").textContent = state.files.map(([name, content]) => `${name} (${content.length} bytes)`).join(", ");
    try {
      if (state.files.length === 0) return say("");
      if (tables().length === 0) return say("Now the table that belongs to it: drop it as well.");
      if (!whole() && state.domain === null) {
        $("mapping").hidden = true;
        return say("Say above what was recorded.", true);
      }
      const found = await (whole() ? asRecording(mine) : asTables(mine));
      if (mine !== asked) return;
      recording = found;
      say(found.said);
      $("diagnose").disabled = false;
    } catch (error) {
      if (mine === asked) say(error.message, true);
    }
  };

  // Takes files instead of those that were there; a header alone waits for its table, and a table for its header.
  const take = ({ name, files: all, domain }) => {
    const alone = all.every(isHeader);
    const kept = alone ? [...tables(), ...meshes()] : tables().length === 0 && !all.some(isHeader) ? state.files : [];
    state = { ...state, files: [...kept, ...all], name: alone && kept.length ? state.name : name, settled: null, maps: null };
    state.header = headers().length ? text(headers()[0][1]) : null;
    $("rig").hidden = $("mapping").hidden = $("answer").hidden = true;
    $("rig").open = false;
    for (const id of ["gap", "every", "rate"]) $(id).value = "";
    complain(null);
    const named = state.header && key(state.header, "domain");
    if (domain ?? here(named)) choose(domain ?? named);
    return update();
  };

  const settle = (changed) => {
    state.settled = columns.read(changed);
    state.maps = columns.maps(state.settled, state.wanted);
    return update();
  };

  const diagnose = async () => {
    complain(null);
    $("answer").hidden = true;
    $("inputs").disabled = true;
    $("work").hidden = false;
    const { files: all, name } = recording;
    const begin = performance.now();
    let stage = "beginning";
    const tick = () => { $("stage").textContent = `${stage} · ${((performance.now() - begin) / 1000).toFixed(0)} s`; };
    engine.progress = (what, done) => {
      stage = done > 0.02 && done < 1 ? `${what}: ${(100 * done).toFixed(0)} %` : what;
      if (done > 0.02) $("bar").value = done;
      else $("bar").removeAttribute("value");
      tick();
    };
    $("bar").removeAttribute("value");
    tick();
    const clock = setInterval(tick, 500);
    try {
      const wish = { name, seed: number("seed"), alpha: number("alpha") };
      show(await engine.ask("diagnose", { wish, files: all }));
    } catch (error) {
      complain(error);
    } finally {
      clearInterval(clock);
      $("work").hidden = true;
      $("inputs").disabled = false;
    }
  };

  // The report says how high it is, so that the page scrolls and it does not.
  const HEIGHT = "<script>new ResizeObserver(() => parent.postMessage({ height: document.documentElement.offsetHeight }, '*')).observe(document.documentElement)</" + "script>";
  const show = (found) => {
    answer = found;
    $("report").srcdoc = found.html.replace(/<\/body><\/html>\s*$/, (end) => HEIGHT + end);
    $("text").textContent = found.text;
    $("took").textContent = `${found.took_s.toFixed(1)} s on this machine`;
    $("answer").hidden = false;
    $("answer").scrollIntoView({ behavior: matchMedia("(prefers-reduced-motion: reduce)").matches ? "auto" : "smooth" });
  };
  addEventListener("message", ({ source, data }) => {
    const high = Number(data?.height);
    if (source === $("report").contentWindow && high > 0 && high < 1e6) $("report").style.height = `${Math.ceil(high) + 4}px`;
  });

  const plain = () => recording.name.split("/").pop().replace(/[^\p{L}\p{N}._-]+/gu, "-") || "recording";
  const archive = () => files.zip(recording.files.map(([name, content]) => [`${plain()}/${name}`, content]));
  $("save-html").onclick = () => files.save(`${plain()}.html`, new Blob([answer.html], { type: "text/html" }));
  $("save-json").onclick = () => files.save(`${plain()}.json`, new Blob([answer.json], { type: "application/json" }));
  $("save-recording").onclick = () => files.save(`${plain()}.zip`, archive());

  const attempt = (work) => async (event) => {
    try {
      await work(event);
    } catch (error) {
      complain(error);
    }
  };
  $("files").onchange = attempt(async ({ target }) => {
    const list = [...target.files];
    target.value = "";
    if (list.length) await take(await files.chosen(list));
  });
  const over = (on) => (event) => {
    event.preventDefault();
    $("drop").classList.toggle("over", on);
  };
  addEventListener("dragover", over(true));
  addEventListener("dragleave", over(false));
  addEventListener("drop", attempt(async (event) => {
    over(false)(event);
    if (!$("inputs").disabled) await take(await files.dropped(event.dataTransfer));
  }));
  $("table").onchange = ({ target }) => settle(target.closest("tr") && target);
  for (const id of ["gap", "every", "rate"]) $(id).onchange = update;
  $("header").oninput = () => {
    clearTimeout(typed);
    typed = setTimeout(() => {
      typed = null;
      state.header = $("header").value;
      const named = key(state.header, "domain");
      if (here(named)) choose(named);
      update();
    }, 300);
  };
  $("again").onclick = () => {
    clearTimeout(typed);
    typed = null;
    state.header = null;
    update();
  };
  $("diagnose").onclick = diagnose;
  $("cancel").onclick = () => engine.cancel();

  const chip = (label, small, attributes, use) => {
    const made = element("button", { type: "button", ...attributes }, label);
    if (small) made.append(element("small", {}, small));
    made.onclick = use;
    return made;
  };
  const begin = async () => {
    await engine.load();
    known = await engine.ask("known");
    $("version").textContent = `Version ${known.version}.`;
    const pick = (id) => () => {
      // A recording that says what it is of is put away for one of something else.
      const other = headers().length > 0 && key(state.header, "domain") !== id;
      state = { ...state, settled: null, maps: null, files: other ? [] : state.files, header: headers().length && !other ? state.header : null };
      $("rig").hidden = $("mapping").hidden = true;
      choose(id);
      update();
    };
    $("domains").append(...known.domains.map(({ id }) => chip(id, "", { role: "radio", value: id }, pick(id))));
    const sample = ({ name, title, words, domain, files: all }) => chip(title, words, { value: name }, () => {
      state.files = [];
      return take({ name, domain, files: all.map(([file, content]) => [file, bytes(content)]) });
    });
    $("samples").append(...known.samples.map(sample));
    choose(null);
    $("inputs").disabled = false;
    document.documentElement.dataset.ready = "yes";
  };
  begin().catch(complain);
})();
