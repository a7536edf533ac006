"""What the programs are made of, as SPDX 2.3 JSON: every shared library that the loader finds for them, with the Debian
package and version that it comes from, and the header-only libraries that are compiled in. Reproducible: sorted, and the time
is SOURCE_DATE_EPOCH's.

    sbom.py --version 0.1.0 --output thermbal.spdx.json PROGRAM ...
"""
import argparse
import datetime
import hashlib
import json
import os
import pathlib
import re
import subprocess

COMPILED_IN = ["libeigen3-dev", "nlohmann-json3-dev", "libcli11-dev"]


def output_of(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def build_id(program):
    """Stripping keeps it: it says which file is meant, before and after packaging."""
    return re.search(r"Build ID: (\w+)", output_of("readelf", "-n", program)).group(1)


def libraries_of(program):
    return {os.path.realpath(path) for path in re.findall(r"(?:=> )?(/\S+) \(0x", output_of("ldd", program))}


def package_of(path):
    """The loader may say /lib for what dpkg knows under /usr/lib."""
    for name in (path, path.removeprefix("/usr"), "/usr" + path):
        found = subprocess.run(["dpkg-query", "-S", name], capture_output=True, text=True, check=False)
        if found.returncode == 0:
            return found.stdout.split(":")[0].split(",")[0]
    return None


def entry(package):
    version, source, homepage = output_of("dpkg-query", "-W", "-f", "${Version}\t${source:Package}\t${Homepage}\n",
                                          package).splitlines()[0].split("\t")
    return {"SPDXID": f"SPDXRef-{re.sub('[^A-Za-z0-9.-]', '-', package)}", "name": package, "versionInfo": version,
            "supplier": "Organization: Debian", "downloadLocation": "NOASSERTION", "filesAnalyzed": False,
            "homepage": homepage or "NOASSERTION", "sourceInfo": f"Debian source package {source}",
            "licenseConcluded": "NOASSERTION", "licenseDeclared": "NOASSERTION", "copyrightText": "NOASSERTION",
            "externalRefs": [{"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl",
                              "referenceLocator": f"pkg:deb/debian/{package}@{version}"}]}


def document(version, programs):
    libraries = {program: libraries_of(program) for program in programs}
    packages = {path: package_of(path) for path in sorted(set().union(*libraries.values()))}
    unknown = [path for path, package in packages.items() if package is None]
    if unknown:
        raise SystemExit(f"sbom.py: no Debian package owns {', '.join(unknown)}")
    compiled_in = [name for name in COMPILED_IN
                   if subprocess.run(["dpkg-query", "-W", name], capture_output=True, check=False).returncode == 0]
    entries = [entry(package) for package in sorted({*packages.values(), *compiled_in})]
    own, relations = [], []
    for program in programs:
        name = pathlib.Path(program).name
        own.append({"SPDXID": f"SPDXRef-{name}", "name": name, "versionInfo": version, "filesAnalyzed": False,
                    "supplier": "Organization: thermbal", "downloadLocation": "NOASSERTION",
                    "licenseConcluded": "Apache-2.0", "licenseDeclared": "Apache-2.0", "copyrightText": "NOASSERTION",
                    "comment": f"GNU build id {build_id(program)}"})
        for kind, used in (("DYNAMIC_LINK", sorted({packages[path] for path in libraries[program]})),
                           ("STATIC_LINK", compiled_in)):
            relations += [{"spdxElementId": f"SPDXRef-{name}", "relationshipType": kind,
                           "relatedSpdxElement": next(e["SPDXID"] for e in entries if e["name"] == package)}
                          for package in used]
        relations.append({"spdxElementId": "SPDXRef-DOCUMENT", "relationshipType": "DESCRIBES",
                          "relatedSpdxElement": f"SPDXRef-{name}"})
    seconds = int(os.environ.get("SOURCE_DATE_EPOCH", "0"))
    created = datetime.datetime.fromtimestamp(seconds, datetime.timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ")
    body = {"packages": own + entries, "relationships": relations}
    name = hashlib.sha256(json.dumps(body, sort_keys=True).encode()).hexdigest()
    return {"spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT", "name": f"thermbal-{version}",
            "documentNamespace": f"urn:thermbal:{version}:{name}",
            "creationInfo": {"created": created, "creators": ["Tool: thermbal .packaging/sbom.py"]}, **body}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--version", required=True)
    parser.add_argument("--output", required=True)
    parser.add_argument("programs", nargs="+")
    arguments = parser.parse_args()
    text = json.dumps(document(arguments.version, arguments.programs), indent=1, sort_keys=True) + "\n"
    pathlib.Path(arguments.output).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
