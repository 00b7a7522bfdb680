// A lane for each requirement, which grows with time: how it stands, and the interval of its robustness.
function flightLanes(model, state, change) {
  const list = document.getElementById("lanes");
  const head = document.getElementById("head");
  let entries = [];

  function build() {
    entries = model.lanes.map((lane) => {
      const put = (tag, name, ...parts) => {
        const made = Object.assign(document.createElement(tag), { className: name });
        made.append(...parts);
        return made;
      };
      const code = Object.assign(document.createElement("code"), { textContent: lane.words, title: lane.words });
      const [stands, value] = [put("span", "stands"), document.createElement("output")];
      const top = put("div", "top", put("b", "", lane.preference ? `${lane.name} (preference)` : lane.name), stands);
      const canvas = document.createElement("canvas");
      canvas.style.height = `${ROOM.goal}px`;
      canvas.setAttribute("aria-hidden", "true");
      const item = put("div", "lane goal", put("div", "label", put("div", "both", top, put("div", "top", code, value))), canvas);
      item.setAttribute("role", "listitem");
      drag(canvas, model, change);
      return { item, canvas, stands, value, lane };
    });
    list.replaceChildren(...entries.map(({ item }) => item));
  }

  function draw(palette) {
    for (const { item, canvas, stands, value, lane } of entries) {
      drawLane(canvas, lane, model, state, palette);
      const said = standing(lane);
      item.dataset.state = said.state;
      if (stands.textContent !== said.stands) stands.textContent = said.stands;
      if (value.textContent !== said.value) value.textContent = said.value;
    }
  }

  // The moment that is shown.
  function update() {
    const first = entries[0];
    if (first) head.style.transform = `translateX(${first.canvas.offsetLeft + GUTTER + (Math.min(state.time, model.horizon) / model.horizon) * (first.canvas.clientWidth - GUTTER)}px)`;
  }

  build();
  return { draw, update, build };
}

// How a requirement stands now, in words.
function standing({ now, unit }) {
  if (!now) return { state: "open", stands: "", value: "" };
  const bound = (value, otherwise) => (value === null ? otherwise : short(value));
  const [least, most] = [bound(now.least, "−∞"), bound(now.most, "∞")];
  const value = `${now.least === now.most ? least : `${least} to ${most}`} ${unit}`.trim();
  if (now.verdict === "satisfied") return { state: "helps", stands: `✓ satisfied (final) from ${tidy(now.since)} s`, value };
  if (now.verdict === "violated") return { state: "harms", stands: `✗ violated (final) from ${tidy(now.since)} s`, value };
  const lost = now.plan !== null && now.plan < 0;
  const planned = now.plan === null ? "" : `${lost ? "forecast violated:" : "forecast"} ${`${short(now.plan)} ${unit}`.trim()}, `;
  const by = `${planned}decided by ${tidy(now.by)} s`;
  if (lost && !now.risk) return { state: "risk", stands: `▲ ${by}`, value };
  return now.risk ? { state: "risk", stands: `▲ at risk, ${by}`, value } : { state: "open", stands: `… open, ${by}`, value };
}
