#!/usr/bin/env python3
"""What `hq` answers, by HyperQueue's Python package: for tests where there is no `hq`.

The job file is read and run by the package's own server and worker; only the words of the command
line and its answers are imitated here.
"""

import json
import os
import subprocess
import sys
import time
import tomllib
from pathlib import Path

from hyperqueue import Client, Job, LocalCluster
from hyperqueue.cluster import WorkerConfig
from hyperqueue.ffi.protocol import ResourceRequest

FOLDER = Path(os.environ["HQ_SERVER_DIR"])


def client():
    return Client((FOLDER / "address").read_text())


def serve():
    FOLDER.mkdir(exist_ok=True)
    cluster = LocalCluster(str(FOLDER), WorkerConfig(cores=2))
    part = FOLDER / "address.part"
    part.write_text(cluster.cluster.server_dir)
    part.rename(FOLDER / "address")
    while True:
        time.sleep(3600)


def job_of(path):
    file = tomllib.loads(Path(path).read_text())
    job = Job(name=file["name"], max_fails=None)
    tasks = {}
    for entry in file["task"]:
        assert entry["stdout"] == entry["stderr"] == "none", entry
        resources = dict(entry["request"][0]["resources"])
        assert resources.pop("mem") > 0
        # The package's worker knows of no memory.
        request = ResourceRequest(cpus=resources.pop("cpus"), resources=resources)
        tasks[entry["id"]] = job.program(
            entry["command"],
            cwd=entry["cwd"],
            stdout=None,
            stderr=None,
            deps=[tasks[need] for need in entry["deps"]],
            crash_limit=entry["crash_limit"],
            resources=request,
        )
    return job


def ended(job):
    return FOLDER / f"job {job} has ended"


match sys.argv[1:]:
    case ["--version"]:
        sys.exit(1)
    case ["server", "start"]:
        serve()
    case ["server", "info"]:
        sys.exit(0 if (FOLDER / "address").exists() else 1)
    case ["job", "submit-file", path, "--output-mode", "json"]:
        job = client().submit(job_of(path))
        words = [sys.executable, __file__, "wait", str(job.id)]
        quiet = subprocess.DEVNULL
        subprocess.Popen(words, stdin=quiet, stdout=quiet, stderr=quiet, start_new_session=True)
        print(json.dumps({"id": job.id}))
    case ["wait", job]:
        # Client.wait_for_jobs prints a bar.
        client().connection.wait_for_jobs([int(job)], lambda _: None)
        ended(job).touch()
    case ["job", "info", job, "--output-mode", "json"]:
        running = 0 if ended(job).exists() else 1
        stats = {"waiting": 0, "running": running}
        print(json.dumps([{"info": {"id": int(job), "task_stats": stats}}]))
    case words:
        sys.exit(f"{words} is not imitated")
