// Tables that sort by a click on a heading, and filter by what is typed; without script they are whole.

const FEW = 25;  // rows that are shown at first
const STEP = 200;

const dress = (section, onRow) => {
  const table = section.querySelector("table"), body = table.tBodies[0];
  const rows = [...body.rows];
  const texts = rows.map((row) => row.textContent.toLowerCase());
  let matching = rows, shown = FEW, order = { column: -1, down: false };
  const bar = document.createElement("p");
  bar.className = "filter";
  const field = document.createElement("input");
  Object.assign(field, { type: "search", placeholder: "Filter by name or any word" });
  field.setAttribute("aria-label", "Filter the table: " + section.querySelector("h2, h3").textContent);
  const count = document.createElement("span");
  count.className = "quiet";
  count.setAttribute("role", "status");
  bar.append(field, count);
  const more = document.createElement("button");
  Object.assign(more, { type: "button", className: "more" });

  const lay = () => {
    const seen = matching.slice(0, shown);
    body.replaceChildren(...seen);
    count.textContent = matching.length === rows.length
      ? `${rows.length.toLocaleString("en")} rows` : `${matching.length} of ${rows.length.toLocaleString("en")} rows`;
    more.hidden = seen.length === matching.length;
    more.textContent = `Show ${Math.min(STEP, matching.length - seen.length)} more`;
  };
  const value = (row) => {
    const text = row.cells[order.column].textContent;
    const figure = parseFloat(text.replaceAll(",", "").replace("\u2212", "-"));
    return row.cells[order.column].classList.contains("number") ? (isNaN(figure) ? -Infinity : figure) : text;
  };
  const compare = (a, b) => {
    const [left, right] = [value(a), value(b)];
    const difference = typeof left === "number" ? left - right : left.localeCompare(right, "en", { numeric: true });
    return order.down ? -difference : difference;
  };
  const choose = () => {
    const words = field.value.toLowerCase().split(/\s+/).filter(Boolean);
    matching = rows.filter((_, k) => words.every((word) => texts[k].includes(word)));
    if (order.column >= 0) matching.sort(compare);
    shown = FEW;
    lay();
  };
  [...table.tHead.rows[0].cells].forEach((head, column) => {
    const button = document.createElement("button");
    button.type = "button";
    button.append(...head.childNodes);
    head.append(button);
    button.addEventListener("click", () => {
      const down = order.column === column ? !order.down : head.classList.contains("number");
      order = { column, down };
      for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
      head.setAttribute("aria-sort", down ? "descending" : "ascending");
      choose();
    });
  });
  field.addEventListener("input", choose);
  more.addEventListener("click", () => { shown += STEP; lay(); });
  // Paper has no button for more rows; there a long table of few columns stands beside itself, head and all.
  let before = shown, second = null;
  const rejoin = () => { if (second) second.remove(); second = null; };
  const halve = () => {
    if (!table.parentElement.matches(".narrow") || matching.length < 2) return;
    second = table.cloneNode();
    const rest = document.createElement("tbody");
    rest.append(...[...body.rows].slice(Math.ceil(matching.length / 2)));
    second.append(table.tHead.cloneNode(true), rest);
    table.after(second);
  };
  addEventListener("beforeprint", () => { rejoin(); before = shown; shown = matching.length; lay(); halve(); });
  addEventListener("afterprint", () => { rejoin(); shown = before; lay(); });
  if (rows.length > 8) table.parentElement.before(bar);
  table.parentElement.after(more);
  if (onRow) body.addEventListener("click", (event) => {
    const row = event.target.closest("tr[data-kind]");
    if (row) onRow(row.dataset.kind, Number(row.dataset.index));
  });
  lay();
};
const dressTables = (onRow) => {
  for (const section of document.querySelectorAll("section.sortable")) dress(section, onRow);
};
