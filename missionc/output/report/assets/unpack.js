// Numbers that were packed (pack.py says how): an Int32Array.
function unpack(text) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const numbers = [];
  let last = 0;
  let place = 0;
  const next = () => {
    let value = 0;
    let weight = 1;
    let byte;
    do {
      byte = bytes[place++];
      value += (byte & 127) * weight;
      weight *= 128;
    } while (byte > 127);
    return value;
  };
  while (place < bytes.length) {
    const code = next();
    if (code === 0) {
      for (let left = next(); left > 0; left--) numbers.push(last);
    } else {
      last += code % 2 ? -(code + 1) / 2 : code / 2;
      numbers.push(last);
    }
  }
  return Int32Array.from(numbers);
}
