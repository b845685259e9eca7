"""Effects of one's own: read from a file, refused in words with the file and the line."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from effect_rigs import BY_ID, TestRig, moved

import bayesimpact as bi
from bayesimpact.errors import InputError
from bayesimpact.model.effects import SEARCHED, UNTRIED, EffectParameter
from bayesimpact.model.own_effects import catalogue_with, check_effects, load_effects

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "own_effect.py"
GOOD = '''from bayesimpact.model.effects import EFFECTS, Effect, EffectParameter, Law


def force(y, v, d, t, z, touching, p, q):
    """N."""
    return p[0] * v * v * v


CUBIC = Effect(
    id="cubic_damping",
    family="free damping",
    title="cubic damping",
    equation="c v^3",
    regime="free",
    energy="dissipates",
    statement="It grows with the cube of the speed: {size}.",
    parameters=(
        EffectParameter("coefficient", "N s3/m3", scale=lambda s: s.damping, lower=0.0),
    ),
    law=Law(force),
)
'''


def written(folder: Path, old: str = "", new: str = "") -> Path:
    file = folder / "mine.py"
    assert old in GOOD
    file.write_text(GOOD.replace(old, new) if old else GOOD)
    return file


def test_a_file_gives_its_effects_in_order(tmp_path):
    twice = GOOD + "\n\nMORE = [CUBIC, CUBIC.__class__(**{**vars(CUBIC), 'id': 'another'})]\n"
    (tmp_path / "mine.py").write_text(twice)
    assert [e.id for e in load_effects(tmp_path / "mine.py")] == ["cubic_damping", "another"]
    whole = catalogue_with(written(tmp_path))
    assert [e.id for e in whole] == [e.id for e in SEARCHED] + ["cubic_damping"]
    assert not set(UNTRIED) & {e.id for e in whole}
    assert catalogue_with(()) == SEARCHED


def test_its_law_is_the_one_that_is_simulated(tmp_path):
    (cubic,) = load_effects(written(tmp_path))
    rig = TestRig(duration=0.5)
    ours = moved([cubic], {"cubic_damping.coefficient": 2.0}, rig)
    known = {"power_damping.coefficient": 2.0, "power_damping.exponent": 3.0}
    assert abs(ours - moved([BY_ID["power_damping"]], known, rig)).max() < 1e-9


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('regime="free"', 'regime="sky"', "line 14, effect 'cubic_damping', regime: found 'sky'"),
        ('"dissipates"', '"eats"', "line 15, effect 'cubic_damping', energy: found 'eats'"),
        ('"cubic_damping"', '"spring_cubic"', "line 10, .*id: found a duplicate id"),
        ('"cubic_damping"', '"Mine!"', "id: found 'Mine!'; accepted: lower-case"),
        ("{size}", "{sise}", "line 16, .*statement"),
        ("N s3/m3", "lbf", "line 17, .*coefficient, unit 'lbf'"),
        ("s: s.damping", "s: s.dumping", "line 18: found AttributeError"),
        ("s: s.damping", "s: -1.0", "scale: found -1.0 on an ordinary rig"),
        ("lower=0.0", "lower=0.0, upper=-1.0", "lower and upper: found 0.0 to -1.0"),
        ("lower=0.0", "lower=2.0", "null: found 0.0"),
        ("lower=0.0", "within=lambda s: (1.0, 2.0)", r"within: found \(1.0, 2.0\)"),
        ("lower=0.0", "null=None, within=lambda s: (2.0, 1.0)", r"within: found \(2.0, 1.0\)"),
        ("lower=0.0", 'scope="planet"', "scope: found 'planet'"),
        ("return p[0]", "return helper() * p[0]", r"mine.py, line \d, .*force: found NameError"),
        ("p[0] * v * v * v", "p[0] * [v].size", "line 6, .*force: found Unknown attribute"),
        ("return p[0] * v * v * v", "pass", "force: found No conversion from none"),
        ("z, touching, p, q", "p, q", "line 4, .*found a function of 6 arguments"),
        ("law=Law(force)", "law=Law(1.0)", "law, force"),
        ("law=Law(force)", "law=Law(force, jump_at_surface=True)", "without surface"),
        ("law=Law(force)", "sets={'c3': 0.0}", "sets: found 'c3'"),
        ("law=Law(force)", "condition=None", "found nothing that it does"),
        ("CUBIC = ", "CUBIC = = ", "line 9: found invalid syntax"),
        ("EFFECTS, Effect, ", "Effect, Efect, ", "line 1: found ImportError"),
        ("law=Law(force)", "law=Law(forc)", "line 20: found NameError"),
        ("CUBIC = ", "raise SystemExit(3)\nCUBIC = ", "line 9: found SystemExit"),
    ],
)  # fmt: skip
def test_faulty_effects_are_refused_with_file_and_line(tmp_path, old, new, said):
    file = written(tmp_path, old, new)
    with pytest.raises(InputError, match=said) as caught:
        load_effects(file)
    assert str(file) in str(caught.value) and "numba" not in str(caught.value).lower()


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        load_effects(tmp_path / "none.py")
    (tmp_path / "empty.py").write_text("from bayesimpact.model.effects import EFFECTS\n")
    with pytest.raises(InputError, match="no effect"):
        load_effects(tmp_path / "empty.py")


def test_effects_handed_over_in_python_are_checked_too(tmp_path):
    (cubic,) = load_effects(written(tmp_path))
    check_effects((*SEARCHED, cubic))
    with pytest.raises(InputError, match="'cubic_damping', id: found a duplicate id"):
        check_effects([cubic, replace(cubic)])
    with pytest.raises(InputError, match="effects: found 3"):
        check_effects([3])
    with pytest.raises(InputError, match="regime: found 'sky'"):
        bi.diagnose(TestRig(duration=0.2).campaign(), effects=[replace(cubic, regime="sky")])


def test_an_initial_state_is_of_a_law_that_has_one():
    """Of a force without a memory, or beside another, it would mean nothing."""
    start = EffectParameter("start", "-", lambda s: 1.0, scope="recording", initial=True)
    loop, rub = BY_ID["hysteresis_bouc_wen"], BY_ID["spring_cubic"]
    check_effects([replace(loop, id="own_loop")])
    for effect, found in ((rub, "start"), (loop, "start, more")):
        more = start if effect is rub else replace(start, name="more")
        wrong = replace(effect, id="own", parameters=(*effect.parameters, more))
        with pytest.raises(InputError, match=f"found {found}; accepted: one initial state"):
            check_effects([wrong])


def test_the_example_can_be_used():
    (detent,) = load_effects(EXAMPLE)
    assert detent.id == "magnetic_detent" and not detent.needs_stop
