"""Reads LAS and LAZ files with laspy and compares their records, as bytes, with the file .raw beside each."""

import sys
from pathlib import Path

import laspy

wrong = 0
read = {}
for name in sys.argv[1:]:
    file = Path(name)
    expected = file.with_suffix(".raw").read_bytes()
    backends = [None]
    if file.suffix == ".laz":
        backends = [laspy.LazBackend.Lazrs, laspy.LazBackend.Laszip]
    for backend in backends:
        try:
            found = laspy.read(file, laz_backend=backend)
            records = found.points.array.tobytes()
            named = list(found.point_format.extra_dimension_names)
            assert found.header.point_count * found.header.point_format.size == len(records), "count"
            assert records == expected, "the records differ"
            assert named[:3] == ["undescribed", "distance", "error"], named
        except Exception as error:
            wrong += 1
            print(f"{file.name} by {backend}: {type(error).__name__}: {error}")
        else:
            read[str(backend)] = read.get(str(backend), 0) + 1
print(", ".join(f"{count} files read back by {backend or 'laspy'}" for backend, count in read.items()))
sys.exit(wrong > 0)
