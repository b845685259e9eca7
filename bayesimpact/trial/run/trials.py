"""Many trials: all truths are sealed first, then the campaigns diagnosed, then the seals opened.

Work goes to the processes of a Dask cluster (one of this machine, or any by its address) or stays
in this process. Workers get what they need by value and return what they found, so a cluster needs
no shared disk; only this process writes files, each in one piece, and a run that was killed goes on
where it stopped.

    DIR/settings.json        what was drawn from
    DIR/sealed/17.json       the truth of trial 17
    DIR/seals.txt            their SHA-256, in the format of sha256sum
    DIR/campaigns/17/        the campaign, until it has been scored
    DIR/trials/17.json       seal, answer and score
    DIR/log.txt              a line for every trial as it ended
"""

from __future__ import annotations

import json
import shutil
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from bayesimpact.cluster import executor
from bayesimpact.data.files import write_text
from bayesimpact.errors import InputError
from bayesimpact.trial.draw.one_trial import draw
from bayesimpact.trial.draw.settings import Settings, settings_from
from bayesimpact.trial.run.blind import answer, campaign_files, open_seal, seal, sealed_text
from bayesimpact.trial.score.answers import score
from bayesimpact.trial.score.line import trial_line

Step = Callable[[str, int], None]
"""(stage, trials done just now)."""


def draw_job(settings: Settings, seed: int) -> dict[str, Any]:
    """On a worker: the text of a trial's truth and its campaign's files, or what went wrong."""
    try:
        drawn = draw(settings, seed)
        files = campaign_files(drawn.campaign, drawn.truth["rounding_m"])
        return {"truth": sealed_text(drawn.truth), "files": files}
    except Exception:
        return {"failed": traceback.format_exc()}


def answer_job(files: Mapping[str, str], search: bool, report: bool) -> dict[str, Any]:
    """On a worker that sees only files: the diagnosis with the seconds of the processor that it
    took, whatever else ran, or what went wrong.
    """
    begun = time.process_time()
    try:
        found = answer(files, search=search, report=report)
        return {"answer": found, "processor_s": round(time.process_time() - begun, 1)}
    except Exception:
        return {"failed": traceback.format_exc()}


def run_trials(
    settings: Settings,
    seeds: Sequence[int],
    out: Path,
    *,
    workers: int = 1,
    scheduler: str | None = None,
    keep: bool = False,
    sealed: Callable[[str], None] | None = None,
    step: Step | None = None,
) -> list[dict[str, Any]]:
    """Draw, seal, diagnose, open and score -> the results in the order of `seeds`.

    Parameters
    ----------
    workers : processes of a local cluster; 1 stays in this process
    scheduler : address of a Dask scheduler to use instead
    keep : leave the campaigns on disk
    sealed : called once, with the SHA-256 of seals.txt, before the first diagnosis
    step : called when trials are drawn or diagnosed

    Raises
    ------
    InputError : `out` holds a run with other settings, or a truth that no longer fits its seal
    """
    store = Store(out, settings)
    store.mend_log()
    say = step or (lambda stage, count: None)
    with executor(workers, scheduler) as distribute:
        missing = [seed for seed in seeds if not store.is_drawn(seed)]
        say("drawing", len(seeds) - len(missing))
        for seed, drawn in distribute(draw_job, ((seed, (settings, seed)) for seed in missing)):
            store.keep_drawn(seed, drawn)
            say("drawing", 1)
        digest = store.publish(seeds)
        if sealed is not None:
            sealed(digest)
        missing = [seed for seed in seeds if not store.is_finished(seed)]
        say("diagnosing", len(seeds) - len(missing))
        how = (settings.search, settings.report)
        jobs = ((seed, (store.files(seed), *how)) for seed in missing)
        for seed, answered in distribute(answer_job, jobs):
            store.finish(seed, answered, keep)
            say("diagnosing", 1)
    return [store.result(seed) for seed in seeds]


class Store:
    """The folder of a run."""

    def __init__(self, out: Path, settings: Settings) -> None:
        self.out = out
        known = out / "settings.json"
        if known.exists() and settings_from(json.loads(known.read_text())) != settings:
            raise InputError(
                f"{known}", "a run with other settings", "the same ones, or a new folder"
            )
        for name in ("sealed", "campaigns", "trials"):
            (out / name).mkdir(parents=True, exist_ok=True)
        write_text(known, json.dumps(settings.document(), indent=1) + "\n")

    def is_finished(self, seed: int) -> bool:
        """Whether the trial has been scored or has failed."""
        return self._result(seed).exists()

    def is_drawn(self, seed: int) -> bool:
        """Whether truth and campaign are there, or no longer needed."""
        whole = self._truth(seed).exists() and (self._campaign(seed) / "campaign.toml").exists()
        return whole or self.is_finished(seed)

    def keep_drawn(self, seed: int, drawn: Mapping[str, Any]) -> None:
        """Store truth and campaign; campaign.toml last, as the sign that all is there."""
        if "failed" in drawn:
            self._finish(seed, {"failed": drawn["failed"], "stage": "drawing"})
            return
        write_text(self._truth(seed), drawn["truth"])
        folder = self._campaign(seed)
        folder.mkdir(exist_ok=True)
        for name in sorted(drawn["files"], key=lambda n: n == "campaign.toml"):
            write_text(folder / name, drawn["files"][name])

    def publish(self, seeds: Sequence[int]) -> str:
        """Write seals.txt; its SHA-256 seals all truths at once."""
        known = self.seals()
        for seed in seeds:
            if self._truth(seed).exists():
                digest = seal(self._truth(seed).read_text(encoding="utf-8"))
                if known.setdefault(seed, digest) != digest:
                    raise InputError(f"{self._truth(seed)}", f"SHA-256 {digest}", known[seed])
        text = "".join(f"{known[seed]}  sealed/{seed}.json\n" for seed in sorted(known))
        write_text(self.out / "seals.txt", text)
        return seal(text)

    def seals(self) -> dict[int, str]:
        """Seed -> SHA-256 of its truth, as published."""
        file = self.out / "seals.txt"
        lines = file.read_text().splitlines() if file.exists() else []
        return {int(Path(line.split()[1]).stem): line.split()[0] for line in lines}

    def files(self, seed: int) -> dict[str, str]:
        """The campaign as texts."""
        folder = self._campaign(seed)
        return {f.name: f.read_text(encoding="utf-8") for f in sorted(folder.iterdir())}

    def finish(self, seed: int, answered: Mapping[str, Any], keep: bool) -> None:
        """Open the seal, score, store."""
        promised = self.seals()[seed]
        truth = open_seal(self._truth(seed).read_text(encoding="utf-8"), promised)
        result: dict[str, Any] = {"seal": promised, "truth": truth, **answered}
        if "answer" in answered:
            try:
                result["score"] = score(truth, answered["answer"])
            except Exception:
                result |= {"failed": traceback.format_exc(), "stage": "scoring"}
        else:
            result["stage"] = "diagnosing"
        if not keep:
            self._discard(seed)  # before the result: killed in between, the trial is drawn anew
        self._finish(seed, result)

    def result(self, seed: int) -> dict[str, Any]:
        """What is stored of a finished trial."""
        content: dict[str, Any] = json.loads(self._result(seed).read_text(encoding="utf-8"))
        return content

    def _finish(self, seed: int, result: Mapping[str, Any]) -> None:
        content = {"schema": "bayesimpact/trial/1", "seed": seed, **result}
        write_text(self._result(seed), json.dumps(content, indent=1, allow_nan=False) + "\n")
        self._log(content)

    def mend_log(self) -> None:
        """Write the lines that a kill between a result and its line has cost."""
        log = self.out / "log.txt"
        known = {line.split()[0] for line in log.read_text().splitlines()} if log.exists() else ()
        for file in sorted(self._results(), key=lambda f: int(f.stem)):
            if file.stem not in known:
                self._log(self.result(int(file.stem)))

    def _results(self) -> list[Path]:
        return [f for f in (self.out / "trials").glob("*.json") if f.stem.isdigit()]

    def _discard(self, seed: int) -> None:
        """Delete the campaign; campaign.toml first, for without it nothing is taken for whole."""
        folder = self._campaign(seed)
        (folder / "campaign.toml").unlink()
        shutil.rmtree(folder)

    def _log(self, content: Mapping[str, Any]) -> None:
        with (self.out / "log.txt").open("a", encoding="utf-8", newline="\n") as log:
            log.write(trial_line(content) + "\n")

    def _truth(self, seed: int) -> Path:
        return self.out / "sealed" / f"{seed}.json"

    def _campaign(self, seed: int) -> Path:
        return self.out / "campaigns" / str(seed)

    def _result(self, seed: int) -> Path:
        return self.out / "trials" / f"{seed}.json"
