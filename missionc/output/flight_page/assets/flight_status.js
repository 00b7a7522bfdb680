// What stands in the header, beside the map and below it: verdicts, the stream, and what was told.
function flightStatus(model) {
  const byId = (id) => document.getElementById(id);
  const news = byId("news");
  let last = 0;
  const many = (count, noun) => `${count} ${noun}${count === 1 ? "" : "s"}`;

  function verdict() {
    const asked = model.lanes.filter((lane) => !lane.preference && lane.now).map((lane) => lane.now);
    const count = (name) => asked.filter((now) => now.verdict === name).length;
    const [lost, open, held] = ["violated", "open", "satisfied"].map(count);
    const risk = asked.filter((now) => now.risk).length;
    const parts = [lost && `✗ ${lost} violated (final)`, risk && `▲ ${risk} at risk`, open - risk && `… ${open - risk} open`, held && `✓ ${held} satisfied (final)`];
    byId("verdict").className = lost ? "fails" : risk ? "steps" : open ? "" : "holds";
    const said = parts.filter(Boolean).join(" · ");
    if (byId("verdict").textContent !== said) byId("verdict").textContent = said;
    document.title = `${lost ? "✗ " : risk ? "▲ " : ""}${model.data.mission} · missionc monitor`;
  }

  function stream({ heard, quiet, ended }) {
    const silent = Boolean(model.now) && !ended && quiet > 2;
    const newest = heard === null ? "no sample yet" : `last sample at ${heard.toFixed(2)} s`;
    byId("stream").className = silent ? "bad" : ended ? "" : "good";
    byId("stream").textContent = ended ? `■ ${ended}` : silent ? `⚠ no samples for ${Math.round(quiet)} s · ${newest}` : `● ${newest}`;
  }

  function agents() {
    const missing = new Set(model.now ? model.now.missing : []);
    for (const button of document.querySelectorAll("#agents button")) {
      const agent = Number(button.dataset.agent);
      const silent = missing.has(agent);
      if (button.classList.contains("silent") === silent) continue;
      button.classList.toggle("silent", silent);
      button.lastChild.textContent = model.data.agents[agent].name + (silent ? " (missing)" : "");
    }
  }

  function tell(fresh) {
    for (const { number, t, tone, says } of fresh) {
      if (number <= last) continue;
      last = number;
      const item = Object.assign(document.createElement("li"), { className: tone });
      if (t !== null) item.append(Object.assign(document.createElement("time"), { textContent: `${t.toFixed(2)} s` }));
      item.append(says);
      news.prepend(item);
    }
    while (news.children.length > 200) news.lastChild.remove();
  }

  byId("title").textContent = model.data.mission;
  byId("about").textContent = `${many(model.agents, "agent")} · ${tidy(model.data.lasts)} s`;
  byId("map").setAttribute("aria-label", `Map of ${model.data.mission} with ${many(model.agents, "moving agent")}`);
  return (message) => {
    verdict();
    stream(message.stream);
    agents();
    tell(message.news);
  };
}
