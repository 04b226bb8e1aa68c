"""The configuration file: there and back, and one line for each mistake."""

import dataclasses

import pytest
import yaml

import skillcrew as sc
from skillcrew.algorithms.registry import algorithm_class
from skillcrew.algorithms.team_search import RaceConfig
from skillcrew.envs.rover.config import RoverConfig
from skillcrew.envs.rover.presets import PRESETS
from skillcrew.envs.rover.world import RoverDomain
from skillcrew.evolution.strategy import StrategyConfig
from skillcrew.experiment.config import RunConfig, algorithm_from_yaml, from_yaml, to_yaml
from skillcrew.experiment.origin import Origin


@pytest.fixture
def file(tmp_path):
    """A valid file; tests break it."""
    path = tmp_path / "config.yaml"
    path.write_text(to_yaml(sc.MADyS(sc.make("rover-t3-c2")), RunConfig()))
    return path


def there_and_back(algorithm, run, path):
    path.write_text(to_yaml(algorithm, run))
    again, run_again = from_yaml(path)
    assert again.config == algorithm.config
    assert again.env.config == algorithm.env.config
    assert again.env.name == algorithm.env.name
    assert run_again == run
    assert to_yaml(again, run_again) == path.read_text()


def changed(value):
    """Another value of the same type, valid for most fields."""
    if isinstance(value, bool):
        return not value
    return value + 2 if isinstance(value, int) else value * 0.75


@pytest.mark.parametrize("name", PRESETS)
def test_presets_come_back_as_they_were(name, tmp_path):
    # One generation of 24 rovers is more than the buffer holds by default.
    algorithm = sc.MADyS(sc.make(name), buffer_capacity=500_000)
    there_and_back(algorithm, RunConfig(), tmp_path / "c.yaml")


def test_non_default_everything_comes_back_as_it_was(tmp_path):
    env = sc.make(
        "rover-t3-c2",
        **{"n_agents": 7, "n_poi_types": 4, "pois_per_type": 2, "poi_values": (1.0, 2.0, 0.5, 1e-3)},
        **{"spatial_coupling": 3, "parents": {"C": ("A", "B"), "D": ("C",), "A": ()}},
        **{"episode_length": 33, "world_size": 12.5, "bounded": True, "max_turn": 1.0, "max_speed": 0.5},
        **{"activation_distance": 3.0, "min_distance": 0.25, "sensor": "closest", "sensor_resolution": 45},
        **{"observation_radius": 9.0, "observed_pois": "vanish", "team_reward": "fraction"},
        **{"breakdowns": 1, "simultaneous": (("A", "B"),), "poi_speed": 0.5},
    )
    evolution = altered(
        sc.EvolutionConfig(), selection="proportional", crossover_share=0.25, level_memory=4.0
    )
    algorithm = sc.MADyS(
        env,
        sc.MADySConfig(
            **{"population": 12, "episodes": 7, "probe_episodes": 4, "updates": 12},
            **{
                "exploration_noise": 0.45,
                "fitness_discount": 0.75,
                "task_ends_skills": True,
                "recorded_episodes": 5,
                "evolver": "strategy",
                "episodes_shared_by": "pair",
                "buffer_capacity": 31_337,
                "skills": ("go_to_agent", "go_to_poi_D"),
            },
            selector=altered(
                sc.SelectorConfig(), hidden=(5,), input_scaling="none", sharing="team", alike=0.25
            ),
            evolution=dataclasses.replace(
                evolution,
                mutation=altered(evolution.mutation, kind="gaussian"),
                phases=altered(evolution.phases),
                restart=altered(evolution.restart),
            ),
            learner=altered(sc.TD3Config(), network=sc.NetworkConfig((6, 7, 8), "none")),
            plateau=altered(sc.PlateauConfig()),
            strategy=altered(StrategyConfig()),
            evosax=altered(sc.EvosaxConfig()),
            coevolution=sc.CoevolutionConfig(
                3, "min", altered(sc.HallOfFameConfig(), sampling="proportional")
            ),
            race=altered(RaceConfig(), finalists=0),
        ),
    )
    origins = Origin("runs/a", 12, "ab1", 3456), True, Origin("runs/b")
    run = RunConfig((7, 5, 2004), 1234, 9, 3, 0.5, 4, False, 7.5, "USR1", "roll-back", ("wandb",), *origins)
    for config, default in ((env.config, sc.RoverConfig()), (algorithm.config, sc.MADySConfig())):
        for field in dataclasses.fields(default):
            # These exclude others; they are in presets.
            differs = getattr(config, field.name) != getattr(default, field.name)
            assert differs or field.name in ("order", "rover_types"), f"{field.name} is the default"
    assert all(getattr(run, f.name) != getattr(RunConfig(), f.name) for f in dataclasses.fields(run))
    there_and_back(algorithm, run, tmp_path / "c.yaml")


def altered(config, **more):
    """A configuration with every plain field changed."""
    plain = {f.name: getattr(config, f.name) for f in dataclasses.fields(config)}
    changes = {name: changed(v) for name, v in plain.items() if isinstance(v, bool | int | float)}
    return dataclasses.replace(config, **{**changes, **more})


SEARCH = {
    "population": 26,
    "episodes": 7,
    "race": RaceConfig(9, 11),
}
REMEMBERING = {"hidden": (5, 9), "input_scaling": "none", "memory": 4, "sharing": "team"}
PHASES = {"phases": 5, "reactive": True, "alike": 0.375, "hold": 3}


@pytest.mark.parametrize(
    ("name", "fields"),
    [
        (
            "madys",
            {
                "evolver": "strategy",
                "episodes_shared_by": "pair",
                "strategy": StrategyConfig(0.25, 0.5, 3.0, restart_below=-7.5),
            },
        ),
        ("madys", {"evolver": "sep_cma_es", "evosax": sc.EvosaxConfig(0.25, 0.5, 3.0)}),
        ("madys", {**SEARCH, "selector": sc.SelectorConfig(**REMEMBERING), "recorded_episodes": 2}),
        ("mfl", {}),
        (
            "mfl",
            {
                **{**SEARCH, "selector": sc.SelectorConfig(**REMEMBERING, **PHASES)},
                **{"pretraining_steps": 999, "exploration_change": 0.375},
            },
        ),
        ("ea", {}),
        ("ea", {**SEARCH, "actor": sc.PolicyConfig(**REMEMBERING)}),
        ("merl", {"sharing": "agent", "reward": "go_to_poi_B+go_to_agent", "migration_period": 7}),
        ("erl", {"reward": "local", "task_ends_value": False}),
        ("cerl", {"discounts": (0.25, 0.5, 0.75), "resources": sc.ResourceConfig(0.5, 0.25, 2.0)}),
        (
            "ea",
            {
                "evolver": "strategy",
                "episodes_shared_by": "pair",
                "population": 6,
                "strategy": StrategyConfig(2.5, 0.125, restart_below=0.4),
            },
        ),
    ],
)
def test_every_algorithm_comes_back_as_it_was(name, fields, tmp_path):
    kind = algorithm_class(name)
    algorithm = kind(sc.make("rover-t2-c3"), **fields)
    path = tmp_path / "c.yaml"
    there_and_back(algorithm, RunConfig(), path)
    again, _ = from_yaml(path)
    assert type(again) is kind
    for field, value in fields.items():
        assert getattr(again.config, field) == value
    for field in dataclasses.fields(algorithm.config):
        assert type(getattr(again.config, field.name)) is type(getattr(algorithm.config, field.name))


def test_a_rover_domain_that_is_no_preset_comes_back(tmp_path):
    env = RoverDomain(RoverConfig(n_agents=3, spatial_coupling=2))
    there_and_back(sc.MADyS(env), RunConfig(), tmp_path / "config.yaml")


@pytest.mark.parametrize(
    ("evolver", "sections"),
    [
        ("genetic", {"evolution"}),
        ("strategy", {"strategy"}),
        ("coevolution", {"evolution", "coevolution"}),
        ("snes", {"evosax"}),
    ],
)
def test_a_file_holds_the_options_of_the_evolver_in_use(evolver, sections, tmp_path):
    algorithm = sc.MADyS(sc.make("rover-t2-c2"), evolver=evolver)
    (tmp_path / "config.yaml").write_text(to_yaml(algorithm, RunConfig()))
    written = yaml.safe_load((tmp_path / "config.yaml").read_text())["algorithm"]
    assert sections == {"evolution", "coevolution", "strategy", "evosax"} & set(written)
    # What somebody set is kept, whether it is looked at or not.
    fields = {"strategy": sc.StrategyConfig(deviation=0.123), "coevolution": sc.CoevolutionConfig(teams=2)}
    algorithm = sc.MADyS(sc.make("rover-t2-c2"), evolver=evolver, **fields)
    (tmp_path / "config.yaml").write_text(to_yaml(algorithm, RunConfig()))
    assert from_yaml(tmp_path / "config.yaml")[0].config == algorithm.config


def test_the_file_is_plain_yaml(file):
    sections = yaml.safe_load(file.read_text())
    assert list(sections) == ["algorithm", "environment", "run"]
    assert sections["algorithm"]["learner"]["discount"] == 0.8
    assert "!!" not in file.read_text()


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("  population:", "  popluation:", [": algorithm", "'popluation'", "nearest first: population,"]),
        ("    discount:", "    discuont:", [": algorithm.learner", "'discuont'", "first: discount,"]),
        ("  n_agents:", "  n_agent:", [": environment", "'n_agent'", "first: n_agents,"]),
        ("  keep:", "  kept:", [": run", "'kept'", "first: keep,"]),
        ("name: madys", "name: madsy", ["algorithm", "'madsy'", "madys"]),
        ("name: rover-t3-c2", "name: rover-t3c2", ["unknown environment", "'rover-t3c2'", "rover-t3-c2"]),
        ("sensor: density", "sensor: closets", ["environment.sensor", "'closets'", "'closest'", "'density'"]),
        ("population: 40", "population: many", ["algorithm.population", "'many'"]),
        ("population: 40", "population: 2.5", ["algorithm.population", "2.5"]),
        ("population: 40", "population: 5", [": algorithm", "population = 5", "elites"]),
        ("    discount: 0.8", "    discount: 1.0", [": algorithm", "learner.discount = 1.0"]),
        ("episode_length: 70", "episode_length: 0", [": environment", "episode_length = 0"]),
        ("spatial_coupling: 2", "spatial_coupling: 5", [": environment", "spatial_coupling = 5", "n_agents"]),
        ("parents: null", "parents: {A: [B], B: [A]}", [": environment", "cycle"]),
        ("parents: null", "parents: {B: [Q]}", [": environment", "'Q'"]),
        ("parents: null", "parents: 7", ["environment.parents", "7"]),
        ("steps: 2000000", "steps: 0", [": run", "steps = 0"]),
        ("  - 0", "  - -1", [": run", "seeds"]),
        ("  - 0", "  - zero", ["run.seeds", "'zero'"]),
        ("skills: null", "skills: [go_to_pio_A]", ["'go_to_pio_A'", "go_to_poi_A"]),
        ("    phases: 0", "    phases: 71", [": algorithm", "selector.phases = 71", "at most 70"]),
        ("    reactive: false", "    reactive: true", [": algorithm", "selector.reactive = True", "phases"]),
        ("      shift: 0.2", "      shift: 2", [": algorithm", "phases.shift = 2", "between 0 and 1"]),
        (
            "      shift: 0.2",
            "      shfit: 0.2",
            [": algorithm.evolution.phases", "'shfit'", "first: shift,"],
        ),
        ("  learner:", "  learner: 3\n  elsewhere:", ["algorithm", "elsewhere"]),
    ],
)
def test_a_mistake_is_one_line_naming_file_field_and_what_is_valid(old, new, expected, file):
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, 1))
    with pytest.raises(sc.UserError) as caught:
        from_yaml(file)
    line = str(caught.value)
    assert "\n" not in line
    assert str(file) in line
    for part in expected:
        assert part in line


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("    max_speed: 1.5", "    max_sped: 1.5", "environment.rover_types.0.max_sped"),
        ("    max_speed: 1.5", "    max_speed: fast", "environment.rover_types.0.max_speed"),
        ("    max_speed: 1.5", "    max_speed: -1", "environment: rover type scout: max_speed = -1"),
        ("    rovers: 2", "    rovers: 4", "environment: n_agents = 3: rover_types have 5"),
    ],
)
def test_a_mistake_in_a_type_of_rovers_is_one_line(old, new, expected, tmp_path):
    text = to_yaml(sc.EA(sc.make("rover-t2-crew")), RunConfig())
    assert text.count(old) == 1
    (tmp_path / "config.yaml").write_text(text.replace(old, new))
    with pytest.raises(sc.UserError) as caught:
        from_yaml(tmp_path / "config.yaml")
    assert expected in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "42",
        "- a\n- b",
        "algorithm: {}",
        "a: [",
        "\tb: 1",
        "x: !unknown 3",
        "\x00",
        "algorithm: {name: madys}",
    ],
)
def test_what_is_no_configuration_is_refused_in_one_line(text, file):
    file.write_text(text)
    with pytest.raises(sc.UserError) as caught:
        from_yaml(file)
    assert str(file) in str(caught.value) and "\n" not in str(caught.value)


def test_bytes_that_are_no_text_and_files_that_are_none(file, tmp_path):
    file.write_bytes(b"\xff\xfe\x00\x81")
    for path in (file, tmp_path, tmp_path / "missing.yaml"):
        with pytest.raises(sc.UserError, match="cannot be read") as caught:
            from_yaml(path)
        assert str(path) in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("section", ["algorithm", "environment", "run"])
@pytest.mark.parametrize("value", [None, 3, [1], {"nested": {"deep": 1}}])
def test_a_section_of_another_shape_is_refused(section, value, file):
    sections = yaml.safe_load(file.read_text())
    file.write_text(yaml.safe_dump({**sections, section: value}))
    with pytest.raises(sc.UserError, match=section) as caught:
        from_yaml(file)
    assert "\n" not in str(caught.value)


def test_tags_that_would_run_code_are_refused_and_run_nothing(file, tmp_path):
    mark = tmp_path / "ran"
    file.write_text(f'algorithm: !!python/object/apply:os.system ["touch {mark}"]\n' + file.read_text())
    with pytest.raises(sc.UserError, match=r"cannot be read as YAML"):
        from_yaml(file)
    assert not mark.exists()


@pytest.mark.parametrize(
    "fields",
    [
        *({field: 0} for field in ("steps", "score_episodes", "generations_per_report", "keep")),
        *({"seeds": seeds} for seeds in ((), (1, 1), (-1,), (2**32,))),
        {"checkpoint_seconds": -1.0},
        {"checkpoint_seconds": float("nan")},
        # Environment steps are counted in 32 bits: a budget that could never be reached is no budget.
        {"steps": 3_000_000_000},
    ],
)
def test_run_options_out_of_range(fields):
    with pytest.raises(sc.UserError, match=next(iter(fields))):
        RunConfig(**fields)


def test_a_partly_given_group_keeps_the_algorithms_own_defaults_for_the_rest(tmp_path):
    """MADyS's learner is not `TD3Config()`: naming its network must change nothing else of it."""
    path = tmp_path / "smaller.yaml"
    path.write_text("algorithm: {name: madys, learner: {network: {hidden: [5]}}, plateau: {window: 7}}\n")
    config = algorithm_from_yaml(path, sc.make("rover-t2-c1")).config
    default = sc.MADyS(sc.make("rover-t2-c1")).config
    assert config.learner.network.hidden == (5,)
    assert config.learner == dataclasses.replace(
        default.learner, network=dataclasses.replace(default.learner.network, hidden=(5,))
    )
    assert config.plateau == dataclasses.replace(default.plateau, window=7)
    assert default.learner.discount != sc.TD3Config().discount
    path.write_text("algorithm: {name: madys, learner: {network: {width: 5}}}\n")
    with pytest.raises(sc.UserError, match=r"unknown field in .*learner.network 'width'"):
        algorithm_from_yaml(path, sc.make("rover-t2-c1"))
