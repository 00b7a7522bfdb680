// Numbers that were packed (pack.py says how): an Int32Array.
function unpack(text) {
  const letters = atob(text);
  const [twice, wide] = [(letters.charCodeAt(0) & 3) === 2, letters.charCodeAt(0) & 4];
  const [bits, all] = wide ? [7, 127] : [3, 7];
  let numbers = new Int32Array(Math.max(16, 2 * letters.length));
  let [count, place, half, last, change] = [0, 1, 0, 0, 0];
  const digit = () => {
    if (wide) return letters.charCodeAt(place++);
    const byte = letters.charCodeAt(place);
    if (half) place++;
    half = 1 - half;
    return half ? byte & 15 : byte >> 4;
  };
  const next = () => {
    let [value, weight, read] = [0, 1, 0];
    do {
      read = digit();
      value += (read & all) * weight;
      weight *= 1 << bits;
    } while (read > all && place < letters.length);
    return value;
  };
  while (place < letters.length) {
    // Half a byte is left over where the last digit was a lower one.
    if (half && place === letters.length - 1 && letters.charCodeAt(place) >> 4 === 15) break;
    const code = next();
    const step = code % 2 ? -(code + 1) / 2 : code / 2;
    let times = code === 0 ? next() : 1;
    if (count + times > numbers.length) {
      const larger = new Int32Array(Math.max(2 * numbers.length, count + times));
      larger.set(numbers);
      numbers = larger;
    }
    for (; times > 0; times--) {
      change = twice ? change + step : step;
      last += change;
      numbers[count++] = last;
    }
  }
  return numbers.slice(0, count);
}
