// A scene of our own for the browser: a box on a floor, finely divided, as .glb bytes.
function grid(origin, along, across, steps, geometry) {
    const first = geometry.positions.length / 3;
    for (let j = 0; j <= steps; j++)
        for (let i = 0; i <= steps; i++)
            for (let c = 0; c < 3; c++)
                geometry.positions.push(origin[c] + along[c] * i / steps + across[c] * j / steps);
    for (let j = 0; j < steps; j++) {
        for (let i = 0; i < steps; i++) {
            const a = first + j * (steps + 1) + i, b = a + steps + 1;
            geometry.indices.push(a, a + 1, b, b, a + 1, b + 1);
        }
    }
}

const pad = (bytes, fill) => Buffer.concat([bytes, Buffer.alloc(-bytes.length & 3, fill)]);

function chunk(type, bytes) {
    const head = Buffer.alloc(8);
    head.writeUInt32LE(bytes.length, 0);
    head.write(type, 4, 'latin1');
    return Buffer.concat([head, bytes]);
}

export function courtGlb() {
    const geometry = { positions: [], indices: [] };
    grid([-4, 0, 4], [8, 0, 0], [0, 0, -8], 64, geometry);
    const low = -1, high = 1, tall = 2;
    grid([low, 0, high], [2, 0, 0], [0, tall, 0], 16, geometry);
    grid([high, 0, low], [-2, 0, 0], [0, tall, 0], 16, geometry);
    grid([high, 0, high], [0, 0, -2], [0, tall, 0], 16, geometry);
    grid([low, 0, low], [0, 0, 2], [0, tall, 0], 16, geometry);
    grid([low, tall, high], [2, 0, 0], [0, 0, -2], 16, geometry);
    const positions = Buffer.from(new Float32Array(geometry.positions).buffer);
    const indices = Buffer.from(new Uint32Array(geometry.indices).buffer);
    const json = {
        asset: { version: '2.0' }, scene: 0, scenes: [{ nodes: [0] }], nodes: [{ mesh: 0 }],
        meshes: [{ primitives: [{ attributes: { POSITION: 0 }, indices: 1, material: 0 }] }],
        materials: [{ pbrMetallicRoughness: { metallicFactor: 0, baseColorFactor: [0.8, 0.8, 0.8, 1] } }],
        accessors: [
            { bufferView: 0, componentType: 5126, count: geometry.positions.length / 3, type: 'VEC3', min: [-4, 0, -4], max: [4, tall, 4] },
            { bufferView: 1, componentType: 5125, count: geometry.indices.length, type: 'SCALAR' },
        ],
        bufferViews: [{ buffer: 0, byteLength: positions.length },
                      { buffer: 0, byteOffset: positions.length, byteLength: indices.length }],
        buffers: [{ byteLength: positions.length + indices.length }],
    };
    const body = Buffer.concat([chunk('JSON', pad(Buffer.from(JSON.stringify(json)), 32)),
                                chunk('BIN\0', Buffer.concat([positions, indices]))]);
    const head = Buffer.alloc(12);
    head.write('glTF', 0, 'latin1');
    head.writeUInt32LE(2, 4);
    head.writeUInt32LE(12 + body.length, 8);
    return Buffer.concat([head, body]);
}
