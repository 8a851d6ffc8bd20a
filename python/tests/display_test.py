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
    assert "FAILED" not in text


def test_hostile_names_are_text(values):
    values["name"] = "<script>alert(1)</script>"
    result = grapnel.Scenario(values).simulate()
    page = Tags(result._repr_html_())
    assert all(tag != "script" for tag, _ in page.found) and any("<script>" in text for text in page.texts)


def test_the_replay_is_a_page_without_a_network(result):
    try:
        replay = result.replay(500)
    except Exception as error:  # built without the viewer
        pytest.skip(str(error))
    (tag, attributes), = Tags(replay._repr_html_()).found
    assert tag == "iframe" and "allow-scripts" in attributes["sandbox"] and "500px" in attributes["style"]
    assert "<!doctype html>" in attributes["srcdoc"].lower() and "grapnel-data" in attributes["srcdoc"]
    assert "MiB" in repr(replay)


def test_figures_name_series_that_results_have(result):
    assert {name for names in display.FIGURES.values() for name in names if name in result} >= {"joints/position", "base/velocity"}
