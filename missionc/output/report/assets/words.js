// The mission's text, line by line, and the margins beside it.
function missionWords(model, choose) {
  const panel = document.getElementById("words");
  // Spans count characters, which JavaScript's strings do not where they go beyond 65536.
  const files = model.data.texts.map(({ name, text }) => ({ name, lines: linesOf(Array.from(text)) }));
  for (const file of files) {
    if (files.length > 1) {
      const heading = document.createElement("h3");
      heading.textContent = file.name;
      panel.append(heading);
    }
    const list = document.createElement("ol");
    for (const line of file.lines) {
      line.element = document.createElement("li");
      line.element.append(...coloured(line.letters.join("")));
      line.element.addEventListener("click", () => choose(files.indexOf(file), line.start, line.start + line.letters.length));
      list.append(line.element);
    }
    panel.append(list);
  }
  let marked = [];

  function show(place) {
    for (const line of marked) {
      line.element.classList.remove("chosen");
      line.element.replaceChildren(...coloured(line.letters.join("")));
    }
    marked = [];
    if (!place) return;
    const [file, start, end] = place;
    for (const line of files[file].lines) {
      const [from, to] = [Math.max(start - line.start, 0), Math.min(end - line.start, line.letters.length)];
      if (from >= to) continue;
      const mark = document.createElement("mark");
      mark.textContent = line.letters.slice(from, to).join("");
      line.element.replaceChildren(...coloured(line.letters.slice(0, from).join("")), mark, ...coloured(line.letters.slice(to).join("")));
      line.element.classList.add("chosen");
      marked.push(line);
    }
    if (marked.length) {
      const target = marked[0].element;
      panel.scrollTop = Math.max(0, target.offsetTop - panel.offsetTop - panel.clientHeight / 3);
    }
  }

  return { show };
}

function linesOf(letters) {
  const lines = [];
  let start = 0;
  letters.forEach((letter, index) => {
    if (letter !== "\n") return;
    lines.push({ start, letters: letters.slice(start, index) });
    start = index + 1;
  });
  if (start < letters.length) lines.push({ start, letters: letters.slice(start) });
  return lines;
}

// A comment, and the word that a statement begins with.
function coloured(text) {
  const found = [];
  const comment = text.indexOf("#");
  const code = comment < 0 ? text : text.slice(0, comment);
  const word = /^(\s*)([a-z_]+)(?=[\s:])/.exec(code);
  if (word) {
    const bold = document.createElement("b");
    bold.textContent = word[2];
    found.push(word[1], bold, code.slice(word[0].length));
  } else found.push(code);
  if (comment >= 0) {
    const dim = document.createElement("i");
    dim.textContent = text.slice(comment);
    found.push(dim);
  }
  return found;
}
