#!/usr/bin/env python3
"""Makes a wheel from an installation of the components program and python.

usage: wheel_files.py [--trial] PREFIX OUT

The wheel contains what the binaries load beyond the libraries of every system, under names with a digest, so that other
packages of the same process may have other versions of them. The platform in its name states the C library that the
binaries need. With --trial, for binaries tuned to this machine, the name contains +trial and no such platform.
"""

import base64
import hashlib
import pathlib
import re
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import zipfile

SOURCE = pathlib.Path(__file__).resolve().parent.parent
DATA = ("scenarios", "robots", "targets", "studies", "meshes")

# The libraries that PEP 600 expects on every system.
SYSTEM = re.compile(r"^(linux-vdso|ld-linux|libc|libm|libdl|librt|libpthread|libutil|libresolv|libnsl|libgcc_s|libstdc\+\+)[-.].*so")


def run(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def libraries_of(binary):
    """Name => file of all libraries that a binary loads, beyond those of every system."""
    found = {}
    for line in run("ldd", binary).splitlines():
        name, arrow, rest = line.strip().partition(" => ")
        if not arrow or SYSTEM.match(name):
            continue
        if rest.startswith("not found"):
            raise SystemExit(f"wheel_files: error: {binary} needs {name}, which is not found")
        found[name] = pathlib.Path(rest.split(" (")[0])
    return found


def needed_by(binary):
    return re.findall(r"\(NEEDED\).*\[(.*)\]", run("readelf", "-dW", binary))


def patched(binary, renamed, rpath):
    """Sets the names of needed libraries, and the folders in which the binary looks for them."""
    # One change per call: patchelf 0.14 mixes up the strings of several.
    for name in needed_by(binary):
        if name in renamed:
            subprocess.run(["patchelf", "--replace-needed", name, renamed[name], binary], check=True)
    subprocess.run(["patchelf", "--force-rpath", "--set-rpath", rpath, binary], check=True)


def c_library(binaries):
    """The newest version of the C library, (2, 36), whose symbols the binaries use."""
    versions = {(int(a), int(b)) for binary in binaries for a, b in re.findall(r"GLIBC_(\d+)\.(\d+)", run("objdump", "-T", binary))}
    return max(versions)


def copyright_of(file):
    """The file with the copyright of a library's Debian package. Packages name files below /lib or below /usr/lib."""
    places = {str(place) for place in (file, file.resolve())}
    places |= {place.removeprefix("/usr") for place in places} | {f"/usr{place}" for place in places if not place.startswith("/usr")}
    for place in sorted(places):
        owner = subprocess.run(["dpkg-query", "--search", place], capture_output=True, text=True, check=False).stdout
        notice = pathlib.Path("/usr/share/doc") / owner.split(":")[0] / "copyright"
        if owner and notice.is_file():
            return notice
    raise SystemExit(f"wheel_files: error: no Debian package has a copyright file for {file}; a wheel must contain it")


def add_libraries(tree, binaries):
    """Copies the libraries of the binaries to grapnel.libs; returns copies and copyright files by library."""
    libraries = {}
    for binary in binaries:
        libraries.update(libraries_of(binary))
    folder = tree / "grapnel.libs"
    folder.mkdir()
    renamed, notices = {}, {}
    for name, file in libraries.items():
        digest = hashlib.sha256(file.read_bytes()).hexdigest()[:8]
        stem, _, suffix = name.partition(".so")
        renamed[name] = f"{stem}-{digest}.so{suffix}"
        shutil.copy(file, folder / renamed[name])
        (folder / renamed[name]).chmod(0o755)
        notices[renamed[name]] = copyright_of(file)
    for name, copy in renamed.items():
        subprocess.run(["patchelf", "--set-soname", copy, folder / copy], check=True)
        patched(folder / copy, renamed, "$ORIGIN")
    for binary in binaries:
        up = "/".join([".."] * len(binary.parent.relative_to(tree).parts))
        patched(binary, renamed, f"$ORIGIN:$ORIGIN/{up}/grapnel.libs")
    return [folder / copy for copy in renamed.values()], notices


def metadata(version):
    text = (SOURCE / "python/pyproject.toml").read_text(encoding="utf-8")

    def value(key):
        return re.search(rf'^{key} = "(.*)"$', text, re.MULTILINE).group(1)

    lines = ["Metadata-Version: 2.1", "Name: grapnel", f"Version: {version}", f"Summary: {value('description')}",
             "License: Apache-2.0", f"Requires-Python: {value('requires-python')}"]
    for requirement in re.search(r"^dependencies = \[(.*)\]$", text, re.MULTILINE).group(1).split(","):
        lines.append(f"Requires-Dist: {requirement.strip()[1:-1]}")
    extras = text.split("[project.optional-dependencies]")[1].split("\n[")[0]
    for extra, packages in re.findall(r"^(\w+) = \[(.*)\]$", extras, re.MULTILINE):
        lines.append(f"Provides-Extra: {extra}")
        lines += [f'Requires-Dist: {package.strip()[1:-1]}; extra == "{extra}"' for package in packages.split(",")]
    return "\n".join(lines) + "\nDescription-Content-Type: text/markdown\n\n" + (SOURCE / "python/README.md").read_text(encoding="utf-8")


def assemble(prefix, tree):
    """The package with program and data; returns its binaries."""
    package, = prefix.glob("lib/python3*/*-packages/grapnel")
    shutil.copytree(package, tree / "grapnel", ignore=shutil.ignore_patterns("__pycache__"))
    program = tree / "grapnel/program"
    for part in ("bin/grapnel", "lib/grapnel/grapnel-fmu.so"):
        (program / part).parent.mkdir(parents=True)
        shutil.copy(prefix / part, program / part)
    for folder in DATA:
        shutil.copytree(prefix / "share/grapnel" / folder, tree / "grapnel/share" / folder)
    module, = (tree / "grapnel").glob("_grapnel*.so")
    return [module, program / "bin/grapnel", program / "lib/grapnel/grapnel-fmu.so"]


def write_wheel(tree, file):
    """All files of a folder, and their digests in RECORD."""
    record, = tree.glob("*.dist-info")
    record = record / "RECORD"
    lines = []
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in sorted(p for p in tree.rglob("*") if p.is_file()):
            name = path.relative_to(tree).as_posix()
            digest = base64.urlsafe_b64encode(hashlib.sha256(path.read_bytes()).digest()).rstrip(b"=").decode()
            lines.append(f"{name},sha256={digest},{path.stat().st_size}")
            archive.write(path, name)
        lines.append(f"{record.relative_to(tree).as_posix()},,")
        archive.writestr(record.relative_to(tree).as_posix(), "\n".join(lines) + "\n")


def main():
    arguments = sys.argv[1:]
    is_trial = arguments[:1] == ["--trial"]
    if len(arguments) != (3 if is_trial else 2):
        sys.exit(__doc__)
    prefix, out = map(pathlib.Path, arguments[-2:])
    version = re.search(r"project\(grapnel VERSION ([0-9.]+)", (SOURCE / "CMakeLists.txt").read_text(encoding="utf-8")).group(1)
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as name:
        tree = pathlib.Path(name)
        binaries = assemble(prefix, tree)
        libraries, notices = add_libraries(tree, binaries)
        major, minor = c_library(binaries + libraries)
        architecture = sysconfig.get_platform().rpartition("-")[2]
        python = f"cp{sys.version_info.major}{sys.version_info.minor}"
        tag = f"{python}-{python}-" + (f"linux_{architecture}" if is_trial else f"manylinux_{major}_{minor}_{architecture}")
        version += "+trial" if is_trial else ""
        info = tree / f"grapnel-{version}.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(metadata(version), encoding="utf-8")
        (info / "WHEEL").write_text(f"Wheel-Version: 1.0\nGenerator: grapnel\nRoot-Is-Purelib: false\nTag: {tag}\n", encoding="utf-8")
        (info / "entry_points.txt").write_text("[console_scripts]\ngrapnel = grapnel.__main__:main\n", encoding="utf-8")
        shutil.copy(SOURCE / "LICENSE", info)
        for library, notice in notices.items():
            shutil.copy(notice, info / f"LICENSE.{library}")
        file = out / f"grapnel-{version}-{tag}.whl"
        write_wheel(tree, file)
    print(f"{file}: {file.stat().st_size / 2**20:.1f} MiB, {len(libraries)} libraries")


if __name__ == "__main__":
    main()
