"""Makes lzma.vtu: a grid of 9 x 9 x 9 points as tetrahedra, in blocks of 8192 bytes that LZMA really compresses."""

import lzma
import struct

N = 9
KUHN = [(0, 1, 3, 7), (0, 5, 1, 7), (0, 3, 2, 7), (0, 2, 6, 7), (0, 4, 5, 7), (0, 6, 4, 7)]
points = [(x, y, z) for z in range(N) for y in range(N) for x in range(N)]
cells = [(x, y, z) for z in range(N - 1) for y in range(N - 1) for x in range(N - 1)]


def index(x, y, z):
    return x + N * (y + N * z)


tets = [[index(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2)) for c in tet] for x, y, z in cells for tet in KUHN]
arrays = [
    ("PointData", "Float32", "linear", 1, "f", [x + 2 * y + 3 * z for x, y, z in points]),
    ("Points", "Float32", "Points", 3, "f", [c for p in points for c in p]),
    ("Cells", "Int32", "connectivity", 1, "i", [v for t in tets for v in t]),
    ("Cells", "Int32", "offsets", 1, "i", [4 * i + 4 for i in range(len(tets))]),
    ("Cells", "UInt8", "types", 1, "B", [10] * len(tets)),
]
data, elements = b"", {}
for section, kind, name, components, code, values in arrays:
    element = f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{components}" format="appended" offset="{len(data)}"/>'
    elements[section] = elements.get(section, "") + element
    raw = struct.pack(f"<{len(values)}{code}", *values)
    blocks = [lzma.compress(raw[i : i + 8192], check=lzma.CHECK_CRC32) for i in range(0, len(raw), 8192)]
    data += struct.pack(f"<{3 + len(blocks)}I", len(blocks), 8192, len(raw) % 8192, *map(len, blocks)) + b"".join(blocks)
body = "".join(f"<{s}>{e}</{s}>" for s, e in elements.items())
with open("lzma.vtu", "wb") as f:
    f.write(
        b'<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt32" '
        b'compressor="vtkLZMADataCompressor"><UnstructuredGrid>'
        + f'<Piece NumberOfPoints="{len(points)}" NumberOfCells="{len(tets)}">{body}</Piece>'.encode()
        + b'</UnstructuredGrid><AppendedData encoding="raw">_' + data + b"</AppendedData></VTKFile>\n"
    )
