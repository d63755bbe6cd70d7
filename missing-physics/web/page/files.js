// Files in and out: what is dropped, and what is saved.
const files = (() => {
  const MOST = 256 * 1024 * 1024;

  const read = async (file) => {
    if (file.size > MOST) throw new Error(`${file.name}: ${file.size} bytes, expected at most ${MOST}: cut it, or use the command.`);
    return [file.name, new Uint8Array(await file.arrayBuffer())];
  };
  const readable = (name) => !name.startsWith(".") && !/\.(md|png|json|py)$/i.test(name);
  // The files of a dropped folder, not of folders in it.
  const inFolder = async (folder) => {
    const reader = folder.createReader();
    const found = [];
    for (;;) {
      // A reader gives a hundred at a time.
      const some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
      if (some.length === 0) break;
      found.push(...some.filter((entry) => entry.isFile && readable(entry.name)));
    }
    return Promise.all(found.map((entry) => new Promise((resolve, reject) => entry.file(resolve, reject))));
  };

  // What was dropped: a name for the recording, and its files.
  const dropped = async (transfer) => {
    const entries = [...transfer.items].map((item) => item.webkitGetAsEntry?.()).filter(Boolean);
    const folder = entries.find((entry) => entry.isDirectory);
    return chosen(folder ? await inFolder(folder) : [...transfer.files], folder?.name);
  };
  const chosen = async (list, folder) => {
    if (list.length === 0) throw new Error("No file that could be read was dropped.");
    const name = folder ?? list.find((file) => file.name !== "recording.toml")?.name.replace(/\.[^.]*$/, "");
    return { name: name || "recording", files: await Promise.all(list.map(read)) };
  };

  const CRC = Uint32Array.from({ length: 256 }, (_, n) => {
    for (let k = 0; k < 8; k += 1) n = n & 1 ? 0xedb88320 ^ (n >>> 1) : n >>> 1;
    return n;
  });
  const crc = (bytes) => {
    let c = 0xffffffff;
    for (const byte of bytes) c = CRC[(c ^ byte) & 255] ^ (c >>> 8);
    return (c ^ 0xffffffff) >>> 0;
  };
  // A ZIP archive of files that are stored as they are (PKWARE's APPNOTE, 4.3); names in UTF-8, dated 1980.
  const zip = (all) => {
    const parts = [];
    const entries = [];
    let at = 0;
    const fields = (...list) => {
      const view = new DataView(new ArrayBuffer(list.reduce((sum, [size]) => sum + size, 0)));
      let place = 0;
      for (const [size, value] of list) {
        if (size === 2) view.setUint16(place, value, true);
        else view.setUint32(place, value, true);
        place += size;
      }
      return new Uint8Array(view.buffer);
    };
    const add = (list, ...pieces) => list.push(...pieces);
    const length = (list) => list.reduce((sum, piece) => sum + piece.length, 0);
    for (const [name, bytes] of all) {
      const path = new TextEncoder().encode(name);
      const common = [[2, 0x800], [2, 0], [2, 0], [2, 0x21], [4, crc(bytes)], [4, bytes.length], [4, bytes.length], [2, path.length], [2, 0]];
      add(entries, fields([4, 0x02014b50], [2, 20], [2, 20], ...common, [2, 0], [2, 0], [2, 0], [4, 0], [4, at]), path);
      add(parts, fields([4, 0x04034b50], [2, 20], ...common), path, bytes);
      at = length(parts);
    }
    const count = all.length;
    const end = fields([4, 0x06054b50], [2, 0], [2, 0], [2, count], [2, count], [4, length(entries)], [4, at], [2, 0]);
    return new Blob([...parts, ...entries, end], { type: "application/zip" });
  };
  const save = (name, blob) => {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(blob);
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 60000);
  };
  return { dropped, chosen, zip, save };
})();
