// The worker: a compiled program comes first, then questions; answers go back by their numbers.
let why = "";
// The program calls these two.
self.progressed = (stage, done) => self.postMessage({ stage, done });
self.stopped = (text) => { why = text; };

const held = (files) => {
  const all = new wasm_bindgen.Files();
  for (const [name, bytes] of files) all.add(name, bytes);
  return all;
};
const calls = {
  known: () => wasm_bindgen.known(),
  propose: ({ wish, files }) => wasm_bindgen.propose(JSON.stringify(wish), files),
  check: ({ name, files }) => wasm_bindgen.check(name, files),
  diagnose: ({ wish, files }) => wasm_bindgen.diagnose(JSON.stringify(wish), files),
};

self.onmessage = ({ data }) => {
  if (data.module) {
    wasm_bindgen.initSync({ module: data.module });
    return;
  }
  const { number, call, asked } = data;
  let files = null;
  try {
    files = held(asked.files ?? []);
    const begin = performance.now();
    const answer = calls[call]({ ...asked, files });
    self.postMessage({ number, answer: JSON.parse(answer), took_s: (performance.now() - begin) / 1000 });
    files.free();
  } catch (error) {
    // A line of text is an answer; anything else is the end of this program.
    if (typeof error === "string") {
      files.free();
      self.postMessage({ number, error });
    } else {
      self.postMessage({ number, error: `The program stopped: ${why || error}`, ended: true });
    }
  }
};
