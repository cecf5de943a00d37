// Counts the messages of an MCAP file with the format's reference implementation; each must be JSON.
import fs from 'node:fs';
import { createRequire } from 'node:module';
const { McapStreamReader, McapIndexedReader } = createRequire(process.cwd() + '/')('@mcap/core');

const [file, how] = process.argv.slice(2);
const bytes = fs.readFileSync(file);
const parse = (message) => JSON.parse(new TextDecoder().decode(message.data));
let count = 0;
if (how === 'indexed') {
  const readable = {
    size: async () => BigInt(bytes.length),
    read: async (offset, length) => new Uint8Array(bytes.buffer, bytes.byteOffset + Number(offset), Number(length)),
  };
  const reader = await McapIndexedReader.Initialize({ readable });
  for await (const message of reader.readMessages({ validateCrcs: true })) parse(message), ++count;
  if (BigInt(count) !== reader.statistics.messageCount) throw new Error('statistics disagree');
} else {
  const reader = new McapStreamReader({ validateCrcs: true });
  reader.append(bytes);
  for (let record; (record = reader.nextRecord()); ) if (record.type === 'Message') parse(record), ++count;
}
console.log(count);
