// Why there is no plan: the requirements in conflict, and each change that gives one, as a card with what it edits.
function suggestionCards(whole, rank, address) {
  const panel = document.getElementById("advice");
  const { advice } = whole;
  if (!advice) return;
  panel.hidden = false;
  const add = (to, tag, text, className = "") => {
    const made = Object.assign(document.createElement(tag), { textContent: tag === "pre" || tag === "del" || tag === "ins" ? text : text.replaceAll("`", ""), className });
    to.append(made);
    return made;
  };
  add(panel, "h2", "Conflicts and relaxations");
  const conflict = advice.conflict.join(" and ");
  if (conflict) add(panel, "p", `${advice.conflict.length > 1 ? "Conflicting requirements" : "Unsatisfiable requirement"}: ${conflict}.`);
  if (advice.trials.length) {
    const list = add(panel, "ul", "");
    for (const trial of advice.trials) add(list, "li", `${trial.change}: ${{ planned: "plan found", impossible: "infeasible", undecided: "not decided within the time limit" }[trial.outcome] || trial.outcome}`);
  }
  add(panel, "h3", advice.changes.length ? "Relaxations with a verified plan" : "No plan for any tested relaxation");
  const cards = add(panel, "div", "", "cards");
  const play = (card, plan, words) => {
    const button = add(card, "button", rank === plan ? "shown" : words);
    button.type = "button";
    button.setAttribute("aria-pressed", String(rank === plan));
    button.addEventListener("click", () => rank !== plan && showPlan(plan, `${address().replace(/([#&])t=[^&]*/, "$1t=0")}&play`));
  };
  const missed = add(cards, "article", "", "card");
  add(missed, "h4", "Closest infeasible candidate");
  add(missed, "p", advice.miss);
  play(missed, 1, "replay this candidate");
  for (const each of advice.changes) {
    const card = add(cards, "article", "", "card");
    add(card, "h4", each.change);
    for (const edit of each.edits) {
      const diff = add(card, "pre", "");
      diff.tabIndex = 0;
      diff.setAttribute("aria-label", `Change of ${edit.file ? `${edit.file}, line ${edit.line}` : "the command line"}`);
      if (edit.line) add(diff, "small", `${edit.file}:${edit.line}\n`);
      for (const line of edit.before.split("\n")) if (line.trim()) add(diff, "del", `- ${line}\n`);
      for (const line of edit.after.split("\n")) if (line.trim()) add(diff, "ins", `+ ${line}\n`);
    }
    const notes = [each.guards ? "loosens a safety requirement" : "", each.proven ? `${each.proven} is proved insufficient` : "", each.smallest ? "" : "a smaller change may suffice"].filter(Boolean);
    if (notes.length) add(card, "p", `${notes.join("; ")}.`, each.guards ? "guards" : "");
    if (each.plan) play(card, each.plan, "replay this plan");
  }
}
