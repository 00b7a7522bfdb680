// The scene as the page has it: what the server drew of a version of the text, its places carried along as one types.

// Every place in the text that the scene names.
function* places(scene) {
  for (const thing of scene.things) {
    yield [thing, "span"];
    for (const piece of thing.pieces) {
      yield [piece, "span"];
      for (const number of numbers(piece)) yield [number, "span"];
    }
  }
}

export const numbers = (piece) => [...piece.points.flat(), ...(piece.radius ? [piece.radius] : [])];

// Carries the places through changes; a number whose digits somebody typed over cannot be dragged until it is read again.
export function carry(scene, changes, dragged) {
  if (!scene || changes.empty) return;
  for (const [holder, key] of places(scene)) {
    const span = holder[key];
    if (!span) continue;
    if ("metres" in holder && !dragged && changes.touchesRange(...span)) holder.fixed ||= "its number is being edited";
    holder[key] = [changes.mapPos(span[0], -1), changes.mapPos(span[1], 1)];
  }
}

// What stood on the map before and cannot be read just now, so that it does not flicker while one types.
export function withGhosts(scene, before, whole) {
  if (whole || !before) return scene;
  const known = new Set(scene.things.map(key));
  const ghosts = before.things.filter((thing) => !known.has(key(thing))).map((thing) => ({ ...thing, ghost: true }));
  return { ...scene, things: [...scene.things, ...ghosts] };
}

export const key = ({ kind, name }) => `${kind} ${name}`;
