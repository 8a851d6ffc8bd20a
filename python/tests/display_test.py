"""Results in matplotlib and in notebooks."""

import html.parser
import warnings

import numpy as np
import pytest

import grapnel
from grapnel import display


@pytest.fixture(scope="module")
def result():
    from conftest import THESIS
    return grapnel.load(THESIS, set={"post_impact.duration": 5}).simulate()


class Tags(html.parser.HTMLParser):
    """Open tags are closed in order; texts and attributes are collected."""

    def __init__(self, text):
        super().__init__()
        self.open, self.texts, self.found = [], [], []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        self.found.append((tag, dict(attributes)))
        self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.found.append((tag, dict(attributes)))

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data)


def test_figures(result):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    from matplotlib import pyplot

    axes = result.plot("joints")
    names = ["joints/position", "joints/velocity", "joints/effort"]
    assert [ax.get_title(loc="left") for ax in axes] == names
    for ax, name in zip(axes, names):
        lines = ax.get_lines()[:6]
        assert [line.get_label() for line in lines] == result.components[name] and result.units[name] in ax.get_ylabel()
        assert np.array_equal(lines[2].get_ydata(), result[name][:, 2], equal_nan=True)
        assert 20 in [line.get_xdata()[0] for line in ax.get_lines()[6:]]  # the impact
    figure, own = pyplot.subplots(2)
    assert len(result.plot(["base/velocity", "joints/effort"], own)) == 2 and own[0].get_lines()
    assert len(result.plot("targets/target-1")) >= 3
    with pytest.raises(ValueError, match="1 axes; 3 series"):
        result.plot("joints", own[0])
    with pytest.raises(KeyError, match="'joint' is neither a figure"):
        result.plot("joint")
    with pytest.raises(ValueError, match="what is empty"):
        result.plot([])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        figure.savefig(pytest.importorskip("io").BytesIO(), format="svg")
    pyplot.close("all")


def test_a_notebook_shows_verdicts_ledger_and_plots(result):
    page = Tags(result._repr_html_())
    text = " ".join(page.texts)
    for sentence in result.verdict:
        assert sentence in text
    for check in result.ledger.values():
        assert check.name in text
    lines = [attributes for tag, attributes in page.found if tag == "polyline"]
    assert len(lines) == 6 + 3 + 3
    points = np.array([[float(x) for x in point.split(",")] for point in lines[0]["points"].split()])
    assert np.all(np.diff(points[:, 0]) >= 0) and np.all((points >= 0) & (points <= [300, 110]))
    assert "Conservation checks: passed" in text and "FAILED" not in text


def test_failed_checks_are_counted_by_kind():
    from conftest import THESIS
    result = grapnel.load(THESIS).simulate()  # the whole motion, in which bodies overlap
    failed = sum(not check.passed for check in result.ledger.values())
    text = " ".join(Tags(result._repr_html_()).texts)
    assert failed > 0 and f"Conservation checks: passed; {failed} other check{'s' if failed > 1 else ''} FAILED" in text


def test_small_plots_have_all_columns_extremes_and_gaps():
    time, values = np.linspace(0, 1, 5000), np.zeros((5000, 14))
    values[1234, 3], values[2000:2100, 13] = 7.5, np.nan
    page = Tags(display._small_plot(time, values, "x", []))
    lines = [attributes["points"].split() for tag, attributes in page.found if tag == "polyline"]
    assert len(lines) == 15 and max(len(line) for line in lines) < 300
    top = min(float(point.split(",")[1]) for point in lines[3])
    assert top == 20.0  # the peak, at the upper edge


def test_hostile_names_are_text(values):
    values["name"] = "<script>alert(1)</script>"
    result = grapnel.Scenario(values).simulate()
    page = Tags(result._repr_html_())
    assert all(tag != "script" for tag, _ in page.found) and any("<script>" in text for text in page.texts)


def test_the_replay_is_a_page_without_a_network(result):
    try:
        replay = result.replay(500)
    except RuntimeError as error:
        if "viewer" not in str(error):
            raise
        pytest.skip(str(error))
    with pytest.raises(ValueError, match="height is 0"):
        result.replay(0)
    (tag, attributes), = Tags(replay._repr_html_()).found
    assert tag == "iframe" and "allow-scripts" in attributes["sandbox"] and "500px" in attributes["style"]
    assert "<!doctype html>" in attributes["srcdoc"].lower() and "grapnel-data" in attributes["srcdoc"]
    assert "MiB" in repr(replay)


def test_figures_name_series_that_results_have(result):
    assert {name for names in display.FIGURES.values() for name in names if name in result} >= {"joints/position", "base/velocity"}
