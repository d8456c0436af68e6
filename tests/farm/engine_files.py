#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks what `velatura farm submit` writes for engines against their specifications.

Usage: engine_files.py BIN | --self-test

Open Job Description: the schema of job templates 2023-09 with the extension TASK_CHUNKING, as far as templates can be checked without their
parameters' values; by openjd-model as well where Python has it. OpenCue: the elements of cjsl 1.15 in their order; by xmllint as well where $VELATURA_TEST_FARM or the folder farm of
$VELATURA_TEST_ASSETS has cjsl-1.15.dtd. --self-test plants faults, which the checks must find.
"""
import copy
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unicodedata
import xml.etree.ElementTree as ElementTree

ROOT = pathlib.Path(__file__).resolve().parents[2]


class Refused(Exception):
    pass


def expect(condition, text):
    if not condition:
        raise Refused(text)


# --- Open Job Description -----------------------------------------------------------------------------------------------------------------

IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,63}")
REFERENCE = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*")


def fields(value, where, required, optional=()):
    expect(isinstance(value, dict), f"{where}: an object")
    for name in required:
        expect(name in value, f"{where}.{name} is missing")
    for name in value:
        expect(name in required or name in optional, f"{where}.{name} is unknown")


def text(value, where, low, high, may_break=False):
    expect(isinstance(value, str), f"{where}: a string")
    expect(low <= len(value) and (high is None or len(value) <= high), f"{where}: {low} to {high} characters")
    expect(all(unicodedata.category(c) != "Cc" or (may_break and c in "\n\r\t") for c in value), f"{where}: a control character")


def whole(value, where, low, high=None):
    number = int(value) if isinstance(value, str) and re.fullmatch(r"[+-]?\d+", value) else value
    expect(isinstance(number, int) and not isinstance(number, bool), f"{where}: a whole number")
    expect(number >= low and (high is None or number <= high), f"{where}: {low} to {high}")


def entries(value, where, low, high=None):
    expect(isinstance(value, list), f"{where}: a list")
    expect(len(value) >= low and (high is None or len(value) <= high), f"{where}: {low} to {high} elements")
    return value


def format_string(value, where, names):
    """Each {{ name }} is one of `names`."""
    rest = value
    while "{{" in rest:
        before, _, rest = rest.partition("{{")
        expect("}}" not in before, f"{where}: an expression that does not begin")
        inside, closed, rest = rest.partition("}}")
        name = inside.strip()
        expect(closed and REFERENCE.fullmatch(name), f"{where}: an expression that does not end, or is no name")
        expect(name in names, f"{where}: {name} is not defined here")
    expect("}}" not in rest, f"{where}: an expression that does not begin")


def int_range(value, where):
    if isinstance(value, list):
        for i, element in enumerate(entries(value, where, 1, 1024)):
            whole(element, f"{where}[{i}]", -2**63, 2**63 - 1)
        return
    text(value, where, 1, None)
    taken = set()
    for part in value.split(","):
        match = re.fullmatch(r"\s*([+-]?\d+)\s*(?:-\s*([+-]?\d+)(?::([+-]?\d+))?)?\s*", part)
        expect(match, f"{where}: \"{part}\" is no range")
        step = int(match[3] or 1)
        expect(step != 0, f"{where}: a step of 0")
        first, last = int(match[1]), int(match[2] or match[1])
        numbers = set(range(first, last + (1 if step > 0 else -1), step)) | {first}
        expect(not numbers & taken, f"{where}: ranges overlap")
        taken |= numbers


def action(value, where, names):
    fields(value, where, ("command",), ("args", "timeout", "cancelation"))
    text(value["command"], f"{where}.command", 1, None)
    format_string(value["command"], f"{where}.command", names)
    for i, word in enumerate(entries(value.get("args", []), f"{where}.args", 0)):
        text(word, f"{where}.args[{i}]", 0, None)
        format_string(word, f"{where}.args[{i}]", names)
    if "timeout" in value:
        whole(value["timeout"], f"{where}.timeout", 1)
    if "cancelation" in value:
        cancel = value["cancelation"]
        fields(cancel, f"{where}.cancelation", ("mode",), ("notifyPeriodInSeconds",))
        expect(cancel["mode"] in ("TERMINATE", "NOTIFY_THEN_TERMINATE"), f"{where}.cancelation.mode")
        if "notifyPeriodInSeconds" in cancel:
            expect(cancel["mode"] == "NOTIFY_THEN_TERMINATE", f"{where}.cancelation: a period without a notification")
            whole(cancel["notifyPeriodInSeconds"], f"{where}.cancelation.notifyPeriodInSeconds", 1, 600)


def parameter(value, where):
    fields(value, where, ("name", "type"), ("description", "default", "allowedValues", "minLength", "maxLength", "objectType", "dataFlow"))
    expect(isinstance(value["name"], str) and IDENTIFIER.fullmatch(value["name"]), f"{where}.name: an identifier")
    expect(value["type"] in ("STRING", "PATH"), f"{where}.type: STRING or PATH")
    if value["type"] == "STRING":
        expect("objectType" not in value and "dataFlow" not in value, f"{where}: of paths only")
    expect(value.get("objectType", "FILE") in ("FILE", "DIRECTORY"), f"{where}.objectType")
    expect(value.get("dataFlow", "NONE") in ("NONE", "IN", "OUT", "INOUT"), f"{where}.dataFlow")
    if "description" in value:
        text(value["description"], f"{where}.description", 1, 2048, may_break=True)
    if "default" in value:
        expect(isinstance(value["default"], str) and len(value["default"]) <= 1024, f"{where}.default: a string of at most 1024 characters")


def step(value, where, names, extensions):
    fields(value, where, ("name", "script"), ("description", "dependencies", "parameterSpace"))
    text(value["name"], f"{where}.name", 1, 64)
    names = set(names)
    if "parameterSpace" in value:
        space = value["parameterSpace"]
        fields(space, f"{where}.parameterSpace", ("taskParameterDefinitions",), ("combination",))
        chunked = 0
        for i, task in enumerate(entries(space["taskParameterDefinitions"], f"{where}.taskParameterDefinitions", 1, 16)):
            at = f"{where}.taskParameterDefinitions[{i}]"
            kind = task.get("type") if isinstance(task, dict) else None
            fields(task, at, ("name", "type", "range") + (("chunks",) if kind == "CHUNK[INT]" else ()))
            expect(kind in ("INT", "CHUNK[INT]"), f"{at}.type")
            expect(isinstance(task["name"], str) and IDENTIFIER.fullmatch(task["name"]), f"{at}.name: an identifier")
            expect(f"Task.Param.{task['name']}" not in names, f"{at}.name: twice")
            int_range(task["range"], f"{at}.range")
            if kind == "CHUNK[INT]":
                chunked += 1
                expect("TASK_CHUNKING" in extensions, f"{at}.type: needs the extension TASK_CHUNKING")
                fields(task["chunks"], f"{at}.chunks", ("defaultTaskCount", "rangeConstraint"), ("targetRuntimeSeconds",))
                whole(task["chunks"]["defaultTaskCount"], f"{at}.chunks.defaultTaskCount", 1)
                whole(task["chunks"].get("targetRuntimeSeconds", 0), f"{at}.chunks.targetRuntimeSeconds", 0)
                expect(task["chunks"]["rangeConstraint"] in ("CONTIGUOUS", "NONCONTIGUOUS"), f"{at}.chunks.rangeConstraint")
            names |= {f"Task.Param.{task['name']}", f"Task.RawParam.{task['name']}"}
        expect(chunked <= 1, f"{where}: more than one chunked parameter")
    fields(value["script"], f"{where}.script", ("actions",))
    fields(value["script"]["actions"], f"{where}.script.actions", ("onRun",))
    action(value["script"]["actions"]["onRun"], f"{where}.onRun", names)


def check_openjd(template):
    fields(template, "template", ("specificationVersion", "name", "steps"), ("$schema", "extensions", "description", "parameterDefinitions"))
    expect(template["specificationVersion"] == "jobtemplate-2023-09", "specificationVersion")
    extensions = entries(template.get("extensions", ["TASK_CHUNKING"][:0]), "extensions", 1 if "extensions" in template else 0)
    expect(set(extensions) <= {"TASK_CHUNKING"}, "extensions: unknown")
    text(template["name"], "name", 1, 128)
    names = {"Session.WorkingDirectory", "Session.HasPathMappingRules", "Session.PathMappingRulesFile"}
    of_name = set()
    for i, definition in enumerate(entries(template.get("parameterDefinitions", []), "parameterDefinitions",
                                           1 if "parameterDefinitions" in template else 0, 50)):
        parameter(definition, f"parameterDefinitions[{i}]")
        expect(f"Param.{definition['name']}" not in names, f"parameterDefinitions[{i}].name: twice")
        names |= {f"Param.{definition['name']}", f"RawParam.{definition['name']}"}
        of_name.add(f"RawParam.{definition['name']}")
        if definition["type"] != "PATH":
            of_name.add(f"Param.{definition['name']}")
    format_string(template["name"], "name", of_name)
    known = {}
    for i, one in enumerate(entries(template["steps"], "steps", 1)):
        step(one, f"steps[{i}]", names, extensions)
        expect(one["name"] not in known, f"steps[{i}].name: twice")
        known[one["name"]] = one
    for one in known.values():
        for dependency in entries(one.get("dependencies", [{}])[:] if "dependencies" in one else [], f"{one['name']}.dependencies",
                                  1 if "dependencies" in one else 0):
            fields(dependency, f"{one['name']}.dependencies", ("dependsOn",))
            expect(dependency["dependsOn"] in known and dependency["dependsOn"] != one["name"], f"{one['name']} depends on a step that is not there")
    rank = dict.fromkeys(known, 0)
    for _ in known:
        for name, one in known.items():
            rank[name] = max([rank[name]] + [rank[d["dependsOn"]] + 1 for d in one.get("dependencies", [])])
    expect(max(rank.values()) < len(known), "steps depend on each other in a circle")


def refusal_of_model(template):
    """What openjd-model, the reference implementation, says of a template without the extension: "" if it accepts it, None where it is not installed."""
    try:
        from openjd.model import DecodeValidationError, decode_job_template
    except ImportError:
        return None
    try:
        decode_job_template(template=template)
        return ""
    except DecodeValidationError as refusal:
        return str(refusal)


# --- OpenCue ------------------------------------------------------------------------------------------------------------------------------

# Elements in their order; "?": may be absent, "*": any number
CJSL = {
    "spec": "facility? dept? show shot user email? uid? job* depends*",
    "job": "paused? priority? maxretries? maxcores? maxgpus? autoeat? localbook? os? env* layers?",
    "layers": "layer+",
    "layer": "cmd range chunk cores? threadable? memory? gpus? gpu? gpu_memory? timeout? timeout_llu? tags? limits? env* services? outputs*",
    "services": "service+", "limits": "limit+", "outputs": "output*", "env": "key*", "depends": "depend*",
    "depend": "depjob deplayer? depframe? onjob onlayer? onframe?",
}
ATTRIBUTES = {"job": {"name"}, "layer": {"name", "type"}, "depend": {"type"}, "key": {"name"}, "output": {"name"}}
DEPENDS = ("LAYER_ON_SIM_FRAME PREVIOUS_FRAME JOB_ON_JOB JOB_ON_LAYER JOB_ON_FRAME LAYER_ON_JOB LAYER_ON_FRAME LAYER_ON_LAYER FRAME_ON_JOB "
           "FRAME_ON_LAYER FRAME_ON_FRAME FRAME_BY_FRAME").split()


def check_element(element, where="spec"):
    model = CJSL.get(element.tag)
    children = [child.tag for child in element]
    if model is None:
        expect(not children, f"{where}: holds text only")
    else:
        expect(not (element.text or "").strip(), f"{where}: text beside elements")
        pattern = "".join(f"(?:{name.rstrip('?*+')} ){name[-1] if name[-1] in '?*+' else ''}" for name in model.split())
        expect(re.fullmatch(pattern, "".join(tag + " " for tag in children)), f"{where}: elements {children}, expected {model}")
    expect(ATTRIBUTES.get(element.tag, set()) <= set(element.attrib), f"{where}: attributes are missing")
    expect(set(element.attrib) <= ATTRIBUTES.get(element.tag, set()) | ({"anyframe"} if element.tag == "depend" else set()),
           f"{where}: unknown attributes")
    for name, value in element.attrib.items():
        expect(re.fullmatch(r"[\w.:-]+", value), f"{where}: {name} is no NMTOKEN: {value}")
    if element.tag == "layer":
        expect(element.get("type") in ("Render", "Util", "Post"), f"{where}: type {element.get('type')}")
    if element.tag == "depend":
        expect(element.get("type") in DEPENDS, f"{where}: type {element.get('type')}")
    for child in element:
        check_element(child, f"{where}/{child.tag}")


def check_opencue(xml):
    root = ElementTree.fromstring(xml)
    expect(root.tag == "spec", "the root is spec")
    check_element(root)
    layers = [layer.get("name") for layer in root.iter("layer")]
    expect(len(set(layers)) == len(layers), "two layers of one name")
    for depend in root.iter("depend"):
        expect(depend.findtext("deplayer") in layers and depend.findtext("onlayer") in layers, "a dependency of a layer that is not there")
    for layer in root.iter("layer"):
        expect(re.fullmatch(r"-?\d+(-\d+)?(,\d+(-\d+)?)*", layer.findtext("range")), f"range {layer.findtext('range')}")


def dtd():
    folders = [os.environ.get("VELATURA_TEST_FARM", "")]
    if os.environ.get("VELATURA_TEST_ASSETS"):
        folders.append(str(pathlib.Path(os.environ["VELATURA_TEST_ASSETS"]) / "farm"))
    return next((pathlib.Path(f) / "cjsl-1.15.dtd" for f in folders if f and (pathlib.Path(f) / "cjsl-1.15.dtd").is_file()), None)


def xmllint(file):
    """Returns: exit code, or None where there is no xmllint or no DTD."""
    if not shutil.which("xmllint") or not dtd():
        return None
    return subprocess.run(["xmllint", "--noout", "--nonet", "--dtdvalid", str(dtd()), str(file)], stderr=subprocess.DEVNULL).returncode


# --- What the program writes ----------------------------------------------------------------------------------------------------------------

def submit(programs, folder, name, *options):
    job = folder / f"{name}.farm"
    done = subprocess.run([str(programs / "velatura"), "farm", "submit", str(ROOT / "scenes/cornell/cornell.usda"), "-o",
                           str(folder / f"{name}.exr"), "--job", str(job), *options], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"farm submit {' '.join(options)}: {done.returncode}\n{done.stdout}{done.stderr}")
    return job


def words_of(template, step_name):
    run = next(s for s in template["steps"] if s["name"] == step_name)["script"]["actions"]["onRun"]
    return [run["command"], *run["args"]]


def check_program(programs):
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        for name, options in {"plain": [], "chunked": ["--chunk", "4"], "odd {{name}} <&>": ["--pieces", "1"],
                              "frames": ["--frames", "1-30x3"]}.items():
            job = submit(programs, folder, name, "--engine", "openjd", *options)
            template = json.loads((job / "openjd/template.json").read_text())
            check_openjd(template)
            if "extensions" not in template:
                expect(not refusal_of_model(template), f"a template that openjd-model accepts: {refusal_of_model(template)}")
            run = next(s for s in template["steps"] if s["name"] == "Render")["script"]["actions"]["onRun"]
            expect(run["cancelation"] == {"mode": "NOTIFY_THEN_TERMINATE", "notifyPeriodInSeconds": 600}, "a stop with time to write")
        chunked = json.loads((folder / "chunked.farm/openjd/template.json").read_text())
        chunks = chunked["steps"][0]["parameterSpace"]["taskParameterDefinitions"][0]
        expect(chunks["type"] == "CHUNK[INT]", "chunks")
        expect(chunks["chunks"]["targetRuntimeSeconds"] == 600, "tasks of --piece-time")

        for name, options in {"cue": ["--show", "s", "--shot", "sh.010"], "cue chunked": ["--chunk", "4", "--threads", "2"],
                              "cue <&> 'q'": ["--pieces", "1"]}.items():
            job = submit(programs, folder, name, "--engine", "opencue", *options)
            check_opencue((job / "opencue.xml").read_text())
            expect(xmllint(job / "opencue.xml") in (None, 0), f"valid by the DTD: {job}")
            command = ElementTree.parse(job / "opencue.xml").getroot().findtext("job/layers/layer/cmd")
            expect(str(job) in command.replace("'\\''", "'"), f"the folder in {command}")

        # The commands of a template, as a worker runs them
        job = submit(programs, folder, "run", "--engine", "openjd", "--res", "16", "12", "--spp", "8", "--pieces", "2", "--bounces", "1")
        template = json.loads((job / "openjd/template.json").read_text())
        values = {f"Param.{p['name']}": p["default"] for p in template["parameterDefinitions"]}
        printed = ""
        for step_name, piece in (("Render", "0"), ("Render", "1"), ("Merge", "")):
            values["Task.Param.Piece"] = piece
            words = [re.sub(r"\{\{\s*([\w.]+)\s*\}\}", lambda m: values[m[1]], word) for word in words_of(template, step_name)]
            done = subprocess.run(words, capture_output=True, text=True)
            expect(done.returncode == 0, f"{words}: {done.returncode}\n{done.stdout}{done.stderr}")
            printed += done.stdout
        expect((folder / "run.exr").exists(), "the merged image")
        expect(re.search(r"^openjd_progress: 100\.0$", printed, re.M), f"openjd_progress in\n{printed}")
        expect(re.search(r"^openjd_status: piece 1 ", printed, re.M), f"openjd_status in\n{printed}")
        (job / "parts/0001.exr").write_bytes(b"x")
        (folder / "run.exr").unlink()
        done = subprocess.run([str(programs / "velatura"), "farm", "merge", str(job), "--progress", "openjd"], capture_output=True, text=True)
        expect(done.returncode == 1 and "openjd_fail: " in done.stdout, f"openjd_fail in\n{done.stdout}")


def check_slurm(programs):
    """What sbatch is called with, by a program in its place."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        calls = folder / "calls"
        sbatch = folder / "bin/sbatch"
        sbatch.parent.mkdir()
        sbatch.write_text(f"#!/bin/sh\nprintf '%s\\n' \"$@\" --- >> '{calls}'\necho \"$(grep -c -- ^---$ '{calls}');cluster\"\n")
        sbatch.chmod(0o755)
        os.environ["PATH"] = f"{sbatch.parent}{os.pathsep}{os.environ['PATH']}"
        job = submit(programs, folder, "big 100%", "--engine", "slurm", "--spp", "3000", "--pieces", "1500", "--slots", "7", "--account", "a b",
                     "--partition", "p", "--sbatch=--mem=8G", "--sbatch", "--qos=low", "--threads", "2")
        first, second, merge = [call.strip().split("\n") for call in calls.read_text().split("---\n")[:3]]
        for call in (first, second, merge):
            for word in ("--parsable", "--requeue", "--open-mode=append", "--account=a b", "--partition=p", "--cpus-per-task=2", "--mem=8G",
                         "--qos=low"):
                expect(word in call, f"{word} in {call}")
        expect("--array=0-999%7" in first and first[-1] == "0", f"the first 1,000 pieces: {first}")
        expect("--array=0-499%7" in second and second[-1] == "1000", f"the other 500: {second}")
        expect("--signal=B:USR2@60" in first, f"a warning to the script alone: {first}")
        expect("--dependency=afterany:1:2" in merge, f"a merge behind all of them: {merge}")
        expect(any(w == f"--output={str(job).replace('%', '%%')}/logs/slurm-%A_%a.log" for w in first), f"a log in the job: {first}")
        for script in ("piece", "merge"):
            expect((job / f"slurm/{script}.sh").read_text().startswith("#!/bin/sh\nexec '"), f"{script}.sh")
        # What Slurm holds is not submitted again
        squeue = folder / "bin/squeue"
        squeue.write_text("#!/bin/sh\nprintf '1 5\\n2 7\\n9 3\\n1 [10-12]\\n3 N/A\\n'\n")
        squeue.chmod(0o755)
        velatura = str(programs / "velatura")
        subprocess.run([velatura, "farm", "retry", str(job)], check=True, stdout=subprocess.DEVNULL)
        first, second, merge = [call.strip().split("\n") for call in calls.read_text().split("---\n")[3:6]]
        expect("--array=0-4,6-999%7" in first, f"all but piece 5: {first}")
        expect("--array=0-6,8-499%7" in second, f"all but piece 1007: {second}")
        squeue.write_text("#!/bin/sh\nseq 0 999 | sed 's/^/4 /'\nseq 0 499 | sed 's/^/2 /'\n")
        done = subprocess.run([velatura, "farm", "merge", str(job), "--resubmit"], capture_output=True, text=True)
        expect(done.returncode == 0 and "1500 pieces wait or run already" in done.stdout, f"nothing to submit: {done.stdout}{done.stderr}")
        expect(calls.read_text().count("---\n") == 6, "no further call of sbatch")
        squeue.write_text("#!/bin/sh\nexit 1\n")
        sbatch.write_text("#!/bin/sh\necho 'sbatch: error: invalid account' >&2\nexit 1\n")
        done = subprocess.run([str(programs / "velatura"), "farm", "retry", str(job)], capture_output=True, text=True)
        expect(done.returncode == 1 and "invalid account" in done.stderr and "[farm-engine]" in done.stderr, f"the refusal: {done.stderr}")


# --- Planted faults -------------------------------------------------------------------------------------------------------------------------

TEMPLATE = {
    "specificationVersion": "jobtemplate-2023-09", "extensions": ["TASK_CHUNKING"], "name": "shot {{RawParam.Job}}",
    "parameterDefinitions": [{"name": "Job", "type": "PATH", "objectType": "DIRECTORY", "dataFlow": "INOUT", "default": "/j"},
                             {"name": "Program", "type": "STRING", "default": "velatura"}],
    "steps": [
        {"name": "Render",
         "parameterSpace": {"taskParameterDefinitions": [
             {"name": "Piece", "type": "CHUNK[INT]", "range": "0-9,12,20-30:2", "chunks": {"defaultTaskCount": 4, "rangeConstraint": "CONTIGUOUS"}}]},
         "script": {"actions": {"onRun": {"command": "{{Param.Program}}", "args": ["{{ Param.Job }}", "{{Task.Param.Piece}}"],
                                          "cancelation": {"mode": "NOTIFY_THEN_TERMINATE", "notifyPeriodInSeconds": 600}}}}},
        {"name": "Merge", "dependencies": [{"dependsOn": "Render"}], "script": {"actions": {"onRun": {"command": "x"}}}}]}

# Paths of the template and what is planted there; None removes
FAULTS = [
    ("specificationVersion", "jobtemplate-2024-01"), ("specificationVersion", None), ("name", ""), ("name", "a\tb"), ("name", "n" * 129),
    ("name", "{{Param.Job}}"), ("name", "a }} b"), ("steps", []), ("steps", None), ("extensions", None), ("extensions", []), ("extensions", ["MOON"]), ("tasks", 1),
    ("parameterDefinitions", []), ("parameterDefinitions/0/name", "9x"), ("parameterDefinitions/0/name", "Program"),
    ("parameterDefinitions/0/type", "DIRECTORY"), ("parameterDefinitions/1/dataFlow", "IN"), ("parameterDefinitions/0/default", "p" * 1025),
    ("parameterDefinitions/0/objectType", "FOLDER"), ("steps/0/name", "Merge"), ("steps/0/name", "s" * 65), ("steps/0/script", None),
    ("steps/1/dependencies/0/dependsOn", "Moon"), ("steps/1/dependencies", []), ("steps/0/dependencies", [{"dependsOn": "Merge"}]),
    ("steps/0/parameterSpace/taskParameterDefinitions", []), ("steps/0/parameterSpace/taskParameterDefinitions/0/range", "0-5,5-9"),
    ("steps/0/parameterSpace/taskParameterDefinitions/0/range", "0-9:0"), ("steps/0/parameterSpace/taskParameterDefinitions/0/range", "0..9"),
    ("steps/0/parameterSpace/taskParameterDefinitions/0/range", ""), ("steps/0/parameterSpace/taskParameterDefinitions/0/range", []),
    ("steps/0/parameterSpace/taskParameterDefinitions/0/range", list(range(1025))),
    ("steps/0/parameterSpace/taskParameterDefinitions/0/type", "INTEGER"), ("steps/0/parameterSpace/taskParameterDefinitions/0/type", "INT"),
    ("steps/0/parameterSpace/taskParameterDefinitions/0/chunks/defaultTaskCount", 0),
    ("steps/0/parameterSpace/taskParameterDefinitions/0/chunks/rangeConstraint", "ANY"),
    ("steps/0/script/actions/onRun/command", ""), ("steps/0/script/actions/onRun/args/0", "{{Param.Moon}}"),
    ("steps/0/script/actions/onRun/args/0", "{{Param.Job"), ("steps/1/script/actions/onRun/args", ["{{Task.Param.Piece}}"]),
    ("steps/0/script/actions/onRun/cancelation/mode", "NOTIFY"), ("steps/0/script/actions/onRun/cancelation/notifyPeriodInSeconds", 601),
    ("steps/0/script/actions/onRun/cancelation/mode", "TERMINATE"), ("steps/0/script/actions/onRun/timeout", 0),
    ("steps/0/script/actions/onEnter", {"command": "x"})]

JOB = ('<?xml version="1.0"?>\n<!DOCTYPE spec PUBLIC "SPI Cue Specification Language" "http://localhost:8080/spcue/dtd/cjsl-1.15.dtd">\n'
       "<spec><facility>f</facility><show>s</show><shot>t</shot><user>u</user>"
       '<job name="j"><paused>False</paused><maxretries>2</maxretries><autoeat>False</autoeat><layers>'
       '<layer name="render" type="Render"><cmd>x</cmd><range>0-9</range><chunk>1</chunk><threadable>True</threadable>'
       "<services><service>shell</service></services></layer>"
       '<layer name="merge" type="Post"><cmd>y</cmd><range>0</range><chunk>1</chunk></layer></layers></job>'
       '<depends><depend type="LAYER_ON_LAYER" anyframe="False"><depjob>j</depjob><deplayer>merge</deplayer><onjob>j</onjob>'
       "<onlayer>render</onlayer></depend></depends></spec>\n")

# What is replaced by what; False: the DTD alone does not see it
XML_FAULTS = [("<show>s</show>", "", True), ("<shot>t</shot><user>u</user>", "<user>u</user><shot>t</shot>", True), (' type="Post"', "", True),
              ('type="Post"', 'type="Merge"', True), ('name="j"', 'name="j k"', True), ("<cmd>x</cmd>", "", True),
              ("<range>0-9</range><chunk>1</chunk>", "<chunk>1</chunk><range>0-9</range>", True), ("<paused>False</paused>", "<pause>x</pause>", True),
              ("LAYER_ON_LAYER", "LAYER_AFTER_LAYER", True), ("<depjob>j</depjob>", "", True), ("<service>shell</service>", "", True),
              ("<autoeat>False</autoeat>", "<autoeat>False</autoeat><maxretries>2</maxretries>", True), ('<job name="j">', "<job>", True),
              ("<onlayer>render", "<onlayer>moon", False), ('name="merge"', 'name="render"', False)]


def planted(path, value, base=None):
    template = copy.deepcopy(base or TEMPLATE)
    *way, last = [int(p) if p.isdigit() else p for p in path.split("/")]
    at = template
    for name in way:
        at = at[name]
    if value is None:
        del at[last]
    else:
        at[last] = value
    return template


def is_refused(check, value):
    try:
        check(value)
        return False
    except Refused:
        return True


def self_test():
    check_openjd(TEMPLATE)
    unseen = [f"{path} = {value!r:.40}" for path, value in FAULTS if not is_refused(check_openjd, planted(path, value))]
    plain = copy.deepcopy(TEMPLATE)
    del plain["extensions"]
    task = plain["steps"][0]["parameterSpace"]["taskParameterDefinitions"][0]
    task["type"] = "INT"
    del task["chunks"]
    check_openjd(plain)
    if refusal_of_model(plain) is not None:
        expect(refusal_of_model(plain) == "", refusal_of_model(plain))
        agreed = [f for f in FAULTS if "chunks" not in f[0] and "extensions" not in f[0] and refusal_of_model(planted(*f, plain))]
        unseen += [f"{path} = {value!r:.40}, which openjd-model refuses" for path, value in agreed if not is_refused(check_openjd, planted(path, value, plain))]
        print(f"openjd-model refuses {len(agreed)} of them")
    check_opencue(JOB)
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "job.xml"
        file.write_text(JOB)
        has_dtd = xmllint(file)
        expect(has_dtd in (None, 0), "a job that is valid by the DTD")
        for old, new, is_of_dtd in XML_FAULTS:
            expect(old in JOB, old)
            xml = JOB.replace(old, new, 1)
            if not is_refused(check_opencue, xml):
                unseen.append(f"{old} -> {new}")
            file.write_text(xml)
            if has_dtd is not None and (xmllint(file) != 0) != is_of_dtd:
                unseen.append(f"{old} -> {new}: the DTD disagrees")
    if unseen:
        sys.exit("engine_files.py does not see:\n" + "\n".join(unseen))
    print(f"{len(FAULTS)} templates and {len(XML_FAULTS)} jobs refused" + ("" if has_dtd is not None else "; no DTD, or no xmllint"))


if __name__ == "__main__":
    try:
        if sys.argv[1:] == ["--self-test"]:
            self_test()
        else:
            check_program(pathlib.Path(sys.argv[1]).resolve())
            check_slurm(pathlib.Path(sys.argv[1]).resolve())
    except Refused as wrong:
        sys.exit(f"expected: {wrong}")
