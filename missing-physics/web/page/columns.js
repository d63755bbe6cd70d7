// The columns of a laboratory's files, and which of the domain's each is.
const columns = (() => {
  const body = () => document.querySelector("#table tbody");
  const MOST = 60;
  const element = (tag, attributes = {}, ...children) => {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    made.append(...children);
    return made;
  };
  // What a channel is in a few words: the beginning of what the domain says of it.
  const brief = (what) => what.split(/[,;(]/)[0].trim();

  const row = (column, proposed, words, settled) => {
    const taken = proposed.mapped.find((m) => m.title === column.title);
    const select = element("select", { "aria-label": `what ${column.title} is` });
    select.append(new Option("not used", ""));
    for (const name of proposed.wanted) {
      const what = name === "run" ? "tells runs apart" : words.get(name);
      select.append(new Option(what ? `${name}: ${brief(what)}` : name, name));
    }
    select.value = taken?.target ?? "";
    const odd = element("span", { class: "odd" });
    const before = settled?.get(column.title);
    // Numbers that were measured, in a unit and along an axis; clocks run one way.
    const number = taken && taken.target !== "run";
    const reversed = element("input", { type: "checkbox", "aria-label": `${column.title} reversed` });
    reversed.checked = before?.reversed ?? false;
    const unit = element("input", { size: 5, placeholder: "unit", "aria-label": `unit of ${column.title}` });
    unit.value = before?.unit ?? "";
    if (number) {
      if (!column.unit) odd.append(unit, " ");
      if (taken.target !== "t_s") odd.append(element("label", {}, reversed, " reversed"));
    }
    const first = column.first.map((value) => (value.length > 16 ? `${value.slice(0, 15)}…` : value)).join(", ");
    const title = element("td", {}, column.title, column.unit ? element("em", {}, column.title.includes(column.unit) ? "" : ` in ${column.unit}`) : "");
    const made = element("tr", {}, title, element("td", {}, first), element("td", {}, select, odd));
    made.settled = () => ({ title: column.title, target: select.value, reversed: number && reversed.checked, unit: number ? unit.value.trim() : "" });
    return made;
  };

  // Shows what was proposed; `words` says what each channel is, `settled` what somebody chose.
  const show = (proposed, words, settled) => {
    const seen = new Set();
    const all = proposed.tables.flatMap((table) => table.columns).filter(({ title }) => !seen.has(title) && seen.add(title));
    body().replaceChildren(...all.slice(0, MOST).map((column) => row(column, proposed, words, settled)));
    const more = all.length - MOST;
    document.getElementById("more").textContent = more > 0 ? `and ${more} more columns, which are not used` : "";
  };

  // What stands in the table now, by the columns' titles; a channel that was just given to one column is taken from others.
  const read = (changed) => {
    const rows = [...body().children].map((r) => [r, r.settled()]);
    const newest = rows.find(([r]) => r.contains(changed))?.[1];
    const kept = rows.filter(([r, s]) => s.target && (s.target !== newest?.target || r.contains(changed)));
    return new Map(kept.map(([, s]) => [s.title, s]));
  };

  // The same as the program is asked: every channel is settled.
  const maps = (settled, wanted) => wanted.map((target) => {
    const from = [...settled.values()].find((s) => s.target === target);
    if (!from) return `${target}=`;
    return `${target}=${from.reversed ? "-" : ""}${from.title}${from.unit ? ` [${from.unit}]` : ""}`;
  });
  return { element, show, read, maps };
})();
