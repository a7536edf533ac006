#!/usr/bin/python3
"""Mends md5sums in packages of debug symbols: ddeb_md5sums.py PACKAGE.ddeb ...

CPack (3.25) writes the absolute path of every file in its build folder there, so that the package depends on the folder's name and
`debsums` finds no file. dpkg wants them from the root of the file system on, without the first slash.
"""
import gzip
import io
import sys
import tarfile

MAGIC, HEADER = b"!<arch>\n", 60


def members(archive):
    """(header, content) of an ar archive."""
    position = len(MAGIC)
    while position < len(archive):
        header = archive[position:position + HEADER]
        size = int(header[48:58])
        position += HEADER
        yield header, archive[position:position + size]
        position += size + size % 2


def from_the_root(md5sums):
    lines = []
    for line in md5sums.decode().splitlines():
        checksum, path = line.split("  ", 1)
        lines.append(f"{checksum}  {path[path.rindex('usr/lib/debug/'):]}\n")
    return "".join(lines).encode()


def mended(control):
    written = io.BytesIO()
    with tarfile.open(fileobj=io.BytesIO(control)) as before, \
            tarfile.open(fileobj=written, mode="w", format=tarfile.USTAR_FORMAT) as after:
        for entry in before:
            content = before.extractfile(entry).read() if entry.isfile() else b""
            if entry.name.endswith("md5sums"):
                content = from_the_root(content)
            entry.size = len(content)
            after.addfile(entry, io.BytesIO(content))
    return gzip.compress(written.getvalue(), 9, mtime=0)


def mend(path):
    with open(path, "rb") as file:
        archive = file.read()
    with open(path, "wb") as file:
        file.write(MAGIC)
        for header, content in members(archive):
            if header.startswith(b"control.tar.gz"):
                content = mended(content)
            file.write(header[:48] + f"{len(content):<10}".encode() + header[58:] + content + b"\n" * (len(content) % 2))


if __name__ == "__main__":
    for package in sys.argv[1:]:
        mend(package)
