"""The document of a reproduction as a page and as tables on the terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

from .remarks import INTRODUCTION, REMARKS
from .stand import SCENES

Document = Mapping[str, Any]


class PrintedTable(NamedTuple):
    """A table of text."""

    title: str
    headings: tuple[str, ...]
    rows: list[tuple[str, ...]]


def tables(document: Document) -> list[PrintedTable]:
    """Return a table for each part of a document."""
    found = [build(document[part]) for part, build in _TABLES.items() if part in document]
    causes = document.get("causes", {})
    return found + [build(causes[cause]) for cause, build in _CAUSES.items() if cause in causes]


def markdown(document: Document) -> str:
    """Return the page `docs/reproduction.md` of a document with all parts."""
    built = {part: build(document[part]) for part, build in _TABLES.items()}
    seeds, training = document["reported_seeds"], document["training_seeds"]
    sections = [
        INTRODUCTION.format(
            world=document["world"],
            seconds=document["duration"],
            seeds=f"{seeds[0]} to {seeds[-1]}",
            training=f"{training[0]} to {training[-1]}",
        ),
        *(_section(table, REMARKS[part]) for part, table in built.items()),
        "## Why\n",
        *(
            _section(build(document["causes"][cause]), REMARKS[cause], 3)
            for cause, build in _CAUSES.items()
        ),
    ]
    return "\n".join(sections)


def _section(table: PrintedTable, remark: str, level: int = 2) -> str:
    return "\n".join(
        [
            f"{'#' * level} {table.title}",
            "",
            "| " + " | ".join(table.headings) + " |",
            "|" + "---|" * len(table.headings),
            *("| " + " | ".join(row) + " |" for row in table.rows),
            "",
            remark,
            "",
        ]
    )


def _milliseconds(dt: float) -> str:
    return f"{1e3 * dt:g}"


def _numbers(*values: float | None) -> tuple[str, ...]:
    return tuple("" if value is None else f"{value:.3g}" for value in values)


def _table1(rows: Iterable[Document]) -> PrintedTable:
    found = []
    for row in rows:
        paper, rig = row["printed"], row["rig"]
        found.append(
            (
                _milliseconds(row["dt"]),
                *(
                    f"{source['rate_time_constant']:.4f}, {source['velocity_time_constant']:.4f}"
                    for source in (paper, rig)
                ),
                *_numbers(
                    paper["before_deg2"],
                    rig["before_deg2"],
                    rig["before_deg2"] / paper["before_deg2"],
                    paper["after_deg2"],
                    rig["after_deg2"],
                    rig["after_deg2"] / paper["after_deg2"],
                    rig["after_with_printed_deg2"],
                ),
            )
        )
    headings = (
        "dt [ms]",
        "printed T_phi, T_V [s]",
        "ours",
        "printed MSE before",
        "ours",
        "ratio",
        "printed MSE after",
        "ours",
        "ratio",
        "ours with printed T",
    )
    return PrintedTable("Table 1: the correction's low-pass constants [deg²]", headings, found)


def _table2(rows: Iterable[Document]) -> PrintedTable:
    found = []
    for row in sorted(rows, key=lambda each: (each["filter"], each["dt"])):
        paper, rig = row.get("printed"), row["rig"]
        verification = None if paper is None else paper["verification_deg2"]
        as_printed, tuned = (
            None if verification is None else rig[name] / verification
            for name in ("with_printed_deg2", "verification_deg2")
        )
        found.append(
            (
                f"`{row['filter']}`",
                _milliseconds(row["dt"]),
                *_numbers(
                    None if paper is None else paper["training_deg2"],
                    verification,
                    rig["with_printed_deg2"],
                    as_printed,
                    rig["training_deg2"],
                    rig["verification_deg2"],
                    tuned,
                ),
                ", ".join(f"{name} {value:.3g}" for name, value in rig["parameters"].items()),
            )
        )
    headings = (
        "filter",
        "dt [ms]",
        "printed training",
        "printed verification",
        "ours, printed parameters",
        "ratio to printed verification",
        "ours tuned, training",
        "ours tuned, verification",
        "ratio to printed verification",
        "ours tuned, parameters",
    )
    return PrintedTable("Table 2: the filters [deg²]", headings, found)


def _fig9(rows: Iterable[Document]) -> PrintedTable:
    found = []
    for row in rows:
        paper, rig = row["printed"], row["rig"]
        found.append(
            (
                row["axis"],
                *_numbers(paper["before"], rig["before"], paper["after"], rig["after"]),
                str(rig["degree"]),
            )
        )
    headings = ("axis", "printed before", "ours", "printed after", "ours", "our degree")
    return PrintedTable("Figs 9 and 10: scale errors, MSE [(m/s²)²]", headings, found)


def _fig11(figures: Document) -> PrintedTable:
    paper, rig = figures["printed"], figures["rig"]
    rows = [
        ("motion over noise, readings [dB]", "", *_numbers(rig["raw_snr_db"])),
        (
            "motion over noise, corrected angle [dB]",
            *_numbers(paper["corrected_snr_db"], rig["corrected_snr_db"]),
        ),
        (
            "share of the noise that follows the motion, readings",
            "",
            *_numbers(rig["raw_coherent_share"]),
        ),
        ("the same, corrected angle", "", *_numbers(rig["corrected_coherent_share"])),
        ("power of the noise, readings [deg²]", "", *_numbers(rig["raw_area_deg2"])),
        ("the same, corrected angle [deg²]", "", *_numbers(rig["corrected_area_deg2"])),
        ("power of the gyro's noise at rest [(deg/s)²]", "",
         *_numbers(rig["gyro_at_rest_area_deg2_s2"])),
    ]  # fmt: skip
    return PrintedTable("Fig. 11: spectra of the noise", ("figure", "printed", "ours"), rows)


def _fig12(figures: Document) -> PrintedTable:
    rig = figures["rig"]
    row = (
        f"`{figures['filter']}`",
        _milliseconds(figures["dt"]),
        *_numbers(rig["mse_deg2"], rig["largest_error_deg"]),
    )
    headings = ("filter", "dt [ms]", "MSE [deg²]", "largest error [deg]")
    return PrintedTable("Fig. 12: one drive with the printed parameters", headings, [row])


def _process_noise(rows: Iterable[Document]) -> PrintedTable:
    found = [
        (_milliseconds(row["dt"]), *_numbers(row["q1_dt_deg2"], row["q1_dt2_deg2"])) for row in rows
    ]
    return PrintedTable(
        'The Kalman filter\'s process noise: row "Kalman" with its printed values [deg²]',
        ("dt [ms]", "q1 dt, as printed (29)", "q1 dt²"),
        found,
    )


def _saturation(rows: Iterable[Document]) -> PrintedTable:
    found = [
        (
            _milliseconds(row["dt"]),
            *_numbers(
                row["time_constant"],
                1e2 * row["saturated_share"],
                row["limited_deg2"],
                row["limited_worst_deg2"],
                row["unlimited_deg2"],
                row["unlimited_worst_deg2"],
            ),
        )
        for row in rows
    ]
    return PrintedTable(
        "Saturation: the complementary filter with its printed time constants [deg²]",
        (
            "dt [ms]",
            "T_c [s]",
            "samples saturated [%]",
            "mean of 20 drives",
            "worst drive",
            "without full scales: mean",
            "worst drive",
        ),
        found,
    )


def _gyro_gain(rows: Iterable[Document]) -> PrintedTable:
    found = [
        (
            f"{100 * row['gyro_scale_error']:g}",
            *(f"{row[name]:.4f}" for name in ("undone_by", "theta")),
            *_numbers(row["verification_deg2"]),
        )
        for row in rows
    ]
    return PrintedTable(
        "Theta: the alpha-beta-theta-gamma filter tuned at 2 ms for other gyros",
        ("gyro scale error [%]", "undone by", "tuned theta", "verification MSE [deg²]"),
        found,
    )


def _stand(figures: Document) -> PrintedTable:
    rows: dict[tuple[str, str], dict[str, Document]] = {}
    for row in figures["rows"]:
        rows.setdefault((row["estimator"], row["setting"]), {})[row["scene"]] = row
    found = [
        (
            estimator,
            setting,
            *_numbers(*(each["rmse_deg"] for each in scenes.values())),
            *_numbers(scenes["jerking"]["largest_deg"], 1e3 * scenes["pendulum"]["delay_s"]),
        )
        for (estimator, setting), scenes in rows.items()
    ]
    headings = (
        "estimator",
        "setting",
        *(f"Fig. {number}, {scene}" for scene, number in SCENES.items()),
        "largest error, jerking",
        "delay, pendulum [ms]",
    )
    return PrintedTable("Chudzik 2021, Figs 6 to 10: rms error on the stand [deg]", headings, found)


def _table3(figures: Document) -> PrintedTable:
    rates = [f"{rate:g}" for rate in figures["yaw_rates"]]
    blank = [None] * len(rates)
    found = [
        (
            row["estimator"],
            imu,
            *_errors(row["printed_rad"] or blank),
            *_errors(row["rig"][imu]["mean_rad"]),
        )
        for imu in figures["rows"][0]["rig"]
        for row in figures["rows"]
    ]
    dmp = ("DMP of the chip", "", *_errors(figures["printed_dmp_rad"]), *_errors(blank))
    headings = (
        "estimator",
        "IMU",
        *(f"printed, {rate} rad/s" for rate in rates),
        *(f"ours, {rate} rad/s" for rate in rates),
    )
    title = "Sihite 2018, Table III: rms error of the tilt [rad]"
    return PrintedTable(title, headings, [dmp, *found])


def _errors(values: Iterable[float | None]) -> tuple[str, ...]:
    return tuple("" if value is None else f"{value:.4f}" for value in values)


_TABLES: Mapping[str, Callable[[Any], PrintedTable]] = {
    "table1": _table1,
    "table2": _table2,
    "fig9": _fig9,
    "fig11": _fig11,
    "fig12": _fig12,
    "stand": _stand,
    "table3": _table3,
}

_CAUSES: Mapping[str, Callable[[Any], PrintedTable]] = {
    "kalman_process_noise": _process_noise,
    "saturation": _saturation,
    "gyro_gain": _gyro_gain,
}
