// Questions to the user, in dialogs of the page.
const byId = (id) => document.getElementById(id);

// One of some answers to a question; empty where it was closed.
export function ask(words, answers, field) {
  const dialog = byId("ask");
  byId("ask-words").textContent = words;
  const input = byId("ask-field");
  input.hidden = !field;
  input.value = field?.value ?? "";
  input.setAttribute("aria-label", field?.label ?? "");
  byId("ask-answers").replaceChildren(
    ...answers.map(([value, text]) => Object.assign(document.createElement("button"), { value, textContent: text })),
  );
  dialog.showModal();
  if (field) input.select();
  return new Promise((resolve) => {
    dialog.addEventListener("close", () => resolve([dialog.returnValue, input.value.trim()]), { once: true });
    dialog.returnValue = "";
  });
}

// A mission from one of the shelves; nothing where the dialog was closed.
export function choose(shelves) {
  const dialog = byId("open");
  const list = byId("open-list");
  const filter = byId("open-filter");
  let chosen = null;
  const titles = { folder: "In this folder", template: "Templates", gallery: "Gallery" };
  const draw = () => {
    const wanted = filter.value.toLowerCase();
    list.replaceChildren();
    for (const [shelf, title] of Object.entries(titles)) {
      const shown = shelves[shelf].filter(({ name, about }) => `${name} ${about}`.toLowerCase().includes(wanted));
      if (!shown.length) continue;
      list.append(Object.assign(document.createElement("h3"), { textContent: title }));
      for (const { name, about } of shown) {
        const button = document.createElement("button");
        button.type = "button";
        button.dataset.mission = name;
        button.append(Object.assign(document.createElement("strong"), { textContent: name }), ` ${about}`);
        button.addEventListener("click", () => {
          chosen = { shelf, name };
          dialog.close();
        });
        list.append(button);
      }
    }
  };
  filter.value = "";
  filter.oninput = draw;
  draw();
  dialog.showModal();
  return new Promise((resolve) => dialog.addEventListener("close", () => resolve(chosen), { once: true }));
}
