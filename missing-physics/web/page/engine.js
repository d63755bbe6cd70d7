// The program, compiled once, in a worker that can be ended at any time.
const engine = (() => {
  const text = (id) => document.getElementById(id).textContent;
  const unpacked = async () => {
    const packed = Uint8Array.from(atob(text("program")), (c) => c.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Response(stream).arrayBuffer();
  };
  const source = URL.createObjectURL(new Blob([text("worker")], { type: "text/javascript" }));
  let module = null;
  let worker = null;
  let number = 0;
  const open = new Map();
  const engine = { progress: () => {} };

  const heard = ({ data }) => {
    if (data.stage !== undefined) return engine.progress(data.stage, data.done);
    const waiting = open.get(data.number);
    open.delete(data.number);
    // What comes from a program that has ended is nobody's answer any more.
    if (!waiting) return;
    if (data.ended) {
      refuse(data.error);
      begin();
    }
    if (data.error === undefined) waiting.resolve({ ...data.answer, took_s: data.took_s });
    else waiting.reject(new Error(data.error));
  };
  const refuse = (why) => {
    for (const waiting of open.values()) waiting.reject(new Error(why));
    open.clear();
  };
  const begin = () => {
    worker?.terminate();
    worker = new Worker(source);
    worker.onmessage = heard;
    worker.onerror = ({ message }) => refuse(`This browser cannot run the program: ${message}`);
    worker.postMessage({ module });
  };

  engine.load = async () => {
    module = await WebAssembly.compile(await unpacked());
    begin();
  };
  // Asks the program; refused with one line where it has no answer.
  engine.ask = (call, asked = {}) => new Promise((resolve, reject) => {
    number += 1;
    open.set(number, { resolve, reject });
    worker.postMessage({ number, call, asked });
  });
  // Ends what is being worked on.
  engine.cancel = () => {
    refuse("Cancelled.");
    begin();
  };
  return engine;
})();
