#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "grapnel/campaign/campaign_points.hpp"
#include "grapnel/campaign/changed_scenario.hpp"
#include "grapnel/campaign/study_document.hpp"
#include "grapnel/campaign/study_files.hpp"
#include "grapnel/result/file_seal.hpp"
#include "grapnel/scenario/problem_setter.hpp"
#include "grapnel/scenario/reader.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/text_file.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

constexpr int kCompared = 4;  // cases whose setters are compared with the reader

// A place of the scenario that an entry of 'uncertain' replaces.
struct DrawnPlace {
  std::vector<PathStep> steps;
  std::string path, entry;
  bool replaced = false;  // the value of the scenario is replaced completely
};

class CampaignReader {
 public:
  explicit CampaignReader(const std::filesystem::path& path)
      : path_(path), points_(std::make_shared<CampaignPoints>()) {}

  std::shared_ptr<CampaignPoints> points() const { return points_; }

  Campaign read(std::vector<Fault>* warnings) {
    StudyDocument document = read_document(path_, file_, faults_);
    root_ = std::move(document.root);
    structure_is_sound_ = document.sound;
    result_.text = std::move(document.bytes);
    take_settings();
    take_design();
    for (std::size_t i = 0; i < entries().size(); ++i)
      points_->paths.push_back(uncertain_paths(file_.uncertain[i], entries()[i], item("uncertain", i)));
    if (expect_scenario() && structure_is_sound_) {
      const std::size_t before = faults_.size();
      check_design();
      if (faults_.size() == before) read_uncertain_values();
    }
    choose_columns();
    read_success();
    read_series();
    select_columns();
    faults_.throw_if_any();
    prefer_setters();
    if (warnings) points_->before_quantities(std::vector<std::size_t>(points_->axes.size(), 0), warnings);
    result_.sha256 = sha256(result_.text + shas_);
    result_.draw = [points = points_](std::uint64_t k) { return points->inputs(k); };
    result_.problem = [points = points_](std::uint64_t k) { return points->study_case(k); };
    result_.scenario_text = [points = points_](std::uint64_t k, const std::filesystem::path& place,
                                               const std::string& comment) {
      return points->scenario_text(k, place, comment);
    };
    return std::move(result_);
  }

 private:
  const std::vector<Node>& entries() const { return part(root_, "uncertain").items; }

  void take_settings() {
    result_.name = file_.name;
    result_.description = file_.description;
    result_.file = path_.string();
    result_.mode = file_.simulate;
    result_.cases = std::max<std::uint64_t>(1, file_.cases);
    result_.seed = file_.seed;
    result_.sampling = file_.sampling;
    result_.plan = file_.plan;
    result_.confidence = file_.confidence;
    if (file_.quantiles) take_quantiles();
    result_.time_limit = file_.time_limit;
    points_->scenario = path_beside(path_, file_.scenario);
    points_->set = read_changes(part(root_, "set"));
    points_->plan_once = result_.plan == CampaignPlan::nominal;
    points_->cases = result_.cases;
  }

  void take_quantiles() {
    const Node& list = part(root_, "quantiles");
    result_.quantiles = *file_.quantiles;
    for (std::size_t i = 1; i < result_.quantiles.size(); ++i) {
      if (result_.quantiles[i] > result_.quantiles[i - 1]) continue;
      faults_.add(list.items[i].mark, fmt::format("quantiles[{}] is {}, must be greater than the previous {}", i,
                                                  result_.quantiles[i], result_.quantiles[i - 1]));
    }
  }

  void take_design() {
    const Node& list = part(root_, "design");
    points_->axes = read_axes(file_.design, list, "design", faults_);
    for (const ReadAxis& axis : points_->axes) {
      for (const ReadAxisValue& value : axis.values) {
        if (value.scenario.empty()) continue;
        faults_.add(value.scenario_mark,
                    fmt::format("{} names a scenario; all cases of a campaign use one scenario: give "
                                "'set'",
                                axis.place));
      }
      if (axis.values.empty()) structure_is_sound_ = false;
      result_.design.push_back(axis.shown);
    }
    const double total = static_cast<double>(result_.total());
    if (total > static_cast<double>(kMostCases))
      faults_.add(list.mark, fmt::format("the design has {:.6g} cases, the limit is {}", total, kMostCases));
  }

  bool expect_scenario() {
    if (file_.scenario.empty()) return false;
    const std::size_t before = faults_.size();
    read_file(points_->scenario, part(root_, "scenario").mark, faults_, kLargestFile, file_.scenario);
    return faults_.size() == before;
  }

  // --- Checks of the scenario ---

  // Each axis alone, the others at their first values.
  void check_design() {
    std::vector<std::size_t> at(points_->axes.size(), 0);
    check_design_point(at);
    for (std::size_t a = 0; a < at.size(); ++a) {
      const ReadAxis& axis = points_->axes[a];
      const std::size_t last = axis.values.size() - 1;
      for (std::size_t value = axis.is_range ? last : 1; value <= std::min(last, kMostChecked); ++value) {
        at[a] = value;
        check_design_point(at);
        if (faults_.full()) return;
      }
      at[a] = 0;
    }
  }

  void check_design_point(const std::vector<std::size_t>& at) {
    try {
      CaptureProblem problem = points_->before_quantities(at);
      merge_columns(columns_, offered_columns(problem, result_.mode == StudyMode::run));
      shas_ += problem.sha256;
      is_planned_ = is_planned_ || (problem.approach && has_something_to_plan(*problem.approach));
      expect_impact(result_.mode, problem, root_, faults_);
      for (std::size_t a = 0; a < at.size(); ++a) {
        const ReadAxis& axis = points_->axes[a];
        if (axis.quantity) check_quantity(axis, at[a], problem);
      }
    } catch (const InputError& error) {
      for (const Fault& fault : error.faults()) add_once(fault, faults_);
    }
  }

  void check_quantity(const ReadAxis& axis, std::size_t value, CaptureProblem problem) {
    const QuantityValue set{*axis.quantity, axis.values[value].quantity};
    try {
      apply_quantities({&set, 1}, problem);
    } catch (const std::exception& error) {
      add_once(axis.values[value].mark, fmt::format("{}: {}", axis.place, error.what()), faults_);
    }
  }

  // The first point of the design, with the plan, which fills places of uncertain values. Null after an error.
  std::shared_ptr<const DesignPoint> first_point() {
    try {
      return points_->design_point(0);
    } catch (const InputError& error) {
      for (const Fault& fault : error.faults()) add_once(fault, faults_);
    } catch (const std::exception& error) {
      const NodeEntry* plan = root_.entry("plan");
      add_once(plan ? plan->mark : root_.mark, fmt::format("plan: nominal: {}", error.what()), faults_);
    }
    return nullptr;
  }

  void read_uncertain_values() {
    const std::size_t before = faults_.size();
    const auto design = first_point();
    if (!design) return;
    std::size_t count = 0;
    for (std::size_t i = 0; i < entries().size(); ++i) {
      ReadUncertain one =
          read_uncertain(file_.uncertain[i], entries()[i], points_->paths[i], design->filled, design->problem, faults_);
      expect_new(points_->paths[i], design->filled, replaces(one.value));
      count += dimensions(one.value);
      result_.inputs.insert(result_.inputs.end(), one.inputs.begin(), one.inputs.end());
      points_->counts.push_back(design->forms[i].nominal.size());
      points_->uncertain.push_back(std::move(one));
    }
    expect_effects(design->filled);
    if (count > SamplePoints::kMostDimensions) {
      faults_.add(part(root_, "uncertain").mark,
                  fmt::format("{} numbers are uncertain, the limit is {}", count, SamplePoints::kMostDimensions));
    }
    if (faults_.size() != before) return;
    points_->samples.emplace(result_.sampling, count, result_.cases, result_.seed);
    points_->forget();
    if (const auto complete = first_point()) check_values(*complete);
  }

  // A place that is drawn twice, or overlaps another, would silently keep the last value.
  void expect_new(const UncertainPaths& where, const Node& scenario, bool replaced) {
    for (std::size_t p = 0; p < where.paths.size(); ++p) {
      const std::string& path = where.paths[p];
      FaultList found_before;
      DrawnPlace place{path_steps(scenario, path, where.path_marks[p], found_before), path, where.place, replaced};
      for (const DrawnPlace& other : drawn_) {
        const Overlap how = overlap(place.steps, other.steps);
        if (how == Overlap::none) continue;
        faults_.add(where.path_marks[p], overlap_message(how, {where.place, path}, {other.entry, other.path}, kDraw));
      }
      drawn_.push_back(std::move(place));
    }
  }

  // An entry of the file and the path of the values that it changes.
  struct EntryPath {
    const std::string& entry;
    const std::string& path;
  };

  struct Verb {
    const char* plural;
    const char* singular;
  };
  static constexpr Verb kDraw{"draw", "draws"}, kVary{"vary", "varies"};

  // Two entries whose values overlap => the error.
  static std::string overlap_message(Overlap how, const EntryPath& here, const EntryPath& other, const Verb& verb) {
    const std::string path = shortened(here.path), other_path = shortened(other.path);
    if (how == Overlap::same) {
      const std::string alias = here.path == other.path ? "" : ", also named " + other_path;
      if (here.entry == other.entry) return fmt::format("{} {} {} twice{}", here.entry, verb.singular, path, alias);
      return fmt::format("{} and {} both {} {}{}", here.entry, other.entry, verb.plural, path, alias);
    }
    return fmt::format("{} {} {}, and {} {} {}, {} it", here.entry, verb.singular, path, other.entry, verb.singular,
                       other_path, how == Overlap::part ? "which contains" : "a part of");
  }

  // A design axis has no effect if all its values are replaced by drawn values, or by those of another axis. The plan
  // uses the values of the design.
  void expect_effects(const Node& scenario) {
    for (const ReadAxis& axis : points_->axes) {
      const bool replaceable = !axis.quantity && !(points_->plan_once && is_planned_);
      std::string by, before;
      bool has_effect = !replaceable;
      for (std::size_t v = 0; v < axis.values.size() && !has_effect; ++v) {
        for (const Change& change : axis.values[v].changes) {
          if (std::exchange(before, change.path) == change.path)
            continue;  // the same for all values of an axis by path
          const DrawnPlace* over = drawn_over(change, scenario);
          has_effect = has_effect || !over;
          if (over) by = over->entry;
        }
      }
      if (has_effect || by.empty()) continue;
      faults_.add(axis.mark,
                  fmt::format("{} varies {}, but {} draws another value in its place for every case; draw it "
                              "as: factor or as: offset",
                              axis.place, in_quotes(axis.shown.name), by));
    }
    if (points_->axes.size() == 2) expect_different(points_->axes[0], points_->axes[1], scenario);
  }

  std::vector<PathStep> steps_of(const Change& change, const Node& scenario) {
    FaultList found_before;
    return path_steps(scenario, change.path, change.mark, found_before);
  }
  const DrawnPlace* drawn_over(const Change& change, const Node& scenario) {
    const std::vector<PathStep> steps = steps_of(change, scenario);
    for (const DrawnPlace& place : drawn_) {
      const Overlap how = overlap(steps, place.steps);
      if (place.replaced && (how == Overlap::same || how == Overlap::part)) return &place;
    }
    return nullptr;
  }

  // Values of the second axis are set last. One path in the same words has been reported.
  void expect_different(const ReadAxis& first, const ReadAxis& second, const Node& scenario) {
    if (first.values[0].changes.size() != 1 || second.values[0].changes.size() != 1) return;
    const Change &a = first.values[0].changes[0], &b = second.values[0].changes[0];
    if (a.path != first.shown.name || b.path != second.shown.name || a.path == b.path) return;
    const Overlap how = overlap(steps_of(b, scenario), steps_of(a, scenario));
    if (how == Overlap::same || how == Overlap::whole)
      faults_.add(second.mark, overlap_message(how, {second.place, b.path}, {first.place, a.path}, kVary));
  }

  // Every uncertain value alone, the others at their medians.
  void check_values(const DesignPoint& design) {
    const double end = 0.5 / static_cast<double>(std::max<std::uint64_t>(result_.cases, 2));
    std::vector<double> point(points_->samples->dimensions(), 0.5);
    const std::size_t before = faults_.size();
    check_point(design, point, "");
    if (faults_.size() != before) return;
    std::size_t at = 0;
    for (const ReadUncertain& one : points_->uncertain) {
      const std::size_t n = dimensions(one.value);
      for (std::size_t d = at; d < at + n && !faults_.full(); ++d) {
        for (const double u : probes(one, end)) {
          point[d] = u;
          check_point(design, point, fmt::format("{}, at probability {:.6g}: ", one.where.place, u));
        }
        point[d] = 0.5;
      }
      at += n;
    }
  }

  // Probabilities at which a distribution is checked: the ends that are likely drawn, or each of several values.
  static std::vector<double> probes(const ReadUncertain& one, double end) {
    const auto* choice = std::get_if<ChosenValue>(&one.value);
    if (!choice) return {end, 1 - end};
    std::vector<double> middles;
    double before = 0;
    const auto& sums = choice->running_sums;
    for (std::size_t i = 0; i < std::min(sums.size(), kMostChecked); ++i) {
      if (sums[i] > before) middles.push_back(0.5 * (before + sums[i]) / sums.back());
      before = sums[i];
    }
    return middles;
  }

  void check_point(const DesignPoint& design, const std::vector<double>& point, const std::string& where) {
    const CampaignPoints::Draw draw = points_->draw(design, point);
    try {
      const CaptureProblem read = points_->read(design, draw);
      setters_agree_ = setters_agree_ && problem_bytes(points_->problem(design, draw)) == problem_bytes(read);
    } catch (const InputError& error) {
      for (Fault fault : error.faults()) {
        fault.message = where + fault.message;
        add_once(std::move(fault), faults_);
      }
    }
  }

  // Setters are used only if their result equals that of the reader, to the last bit.
  void prefer_setters() {
    const auto design = points_->design_point(0);
    for (std::uint64_t k = 0; k < kCompared && setters_agree_; ++k) {
      std::vector<double> point(points_->samples->dimensions());
      points_->samples->at(k, point);
      const CampaignPoints::Draw draw = points_->draw(*design, point);
      try {
        const std::string read = problem_bytes(points_->read(*design, draw));
        setters_agree_ = problem_bytes(points_->problem(*design, draw)) == read;
      } catch (const InputError&) {
        // The combination of values is invalid; the case fails with the reader and with the setters.
      }
    }
    if (!setters_agree_) points_->read_instead();
  }

  // --- Columns ---

  void choose_columns() {
    const Node& list = part(part(root_, "keep"), "columns");
    chosen_ = chosen_columns(list, columns_, faults_);
  }

  std::vector<std::string> names(bool only_selected) const {
    std::vector<std::string> all;
    for (std::size_t c = 0; c < columns_.size(); ++c) {
      if (!only_selected || chosen_[c]) all.push_back(columns_[c].name);
    }
    for (const CampaignInput& input : result_.inputs) all.push_back(input.name);
    return all;
  }

  struct Condition {
    std::string text, name;
    Mark mark;
    bool plain = true;
  };

  std::vector<Condition> conditions() const {
    std::vector<Condition> all;
    const Node& list = part(root_, "success");
    for (std::size_t i = 0; file_.success && i < file_.success->size(); ++i) {
      const auto& one = (*file_.success)[i];
      const auto* named = std::get_if<NamedCondition>(&one);
      const Node& holds = named ? part(list.items[i], "holds") : list.items[i];
      const std::string& text = named ? named->holds : std::get<std::string>(one);
      if (!text.empty()) all.push_back({text, named ? named->name : "", holds.mark, holds.plain});
    }
    const auto captured = [](const Column& column) { return column.name == "captured"; };
    if (!root_.entry("success") && std::any_of(columns_.begin(), columns_.end(), captured))
      all.push_back({"captured", "captured", root_.mark, true});
    return all;
  }

  // Columns read by conditions are stored, so that the table shows reasons.
  void read_success() {
    if (columns_.empty() || (result_.inputs.empty() && !entries().empty())) return;
    const std::vector<std::string> all = names(false);
    std::vector<std::string> units;
    for (const Column& column : columns_) units.push_back(column.unit);
    for (const CampaignInput& input : result_.inputs) units.push_back(input.unit);
    for (const Condition& condition : conditions()) {
      try {
        const Criterion criterion = Criterion::parse(condition.text, all, condition.name, units);
        for (const std::size_t index : criterion.reads()) {
          if (index >= chosen_.size()) continue;
          chosen_[index] = true;
          if (is_capture_column(columns_[index].name)) select_capture_columns();
        }
      } catch (const CriterionError& error) {
        Mark mark = condition.mark;
        // For a text on several lines, or with escapes, the error is reported at its beginning.
        if (condition.text.find('\n') == std::string::npos)
          mark.column += static_cast<int>(error.offset) + (condition.plain ? 0 : 1);
        faults_.add(mark, fmt::format("success: {}", error.what()));
      }
    }
  }

  static bool is_capture_column(const std::string& name) {
    return name == "captured" || (name.starts_with("grasps/") && name.ends_with("/captured"));
  }
  // Columns that give the reason for an open grasp, and whether an envelope was evaluated.
  void select_capture_columns() {
    for (std::size_t c = 0; c < columns_.size(); ++c) {
      const std::string& name = columns_[c].name;
      if (is_capture_column(name) || name == "captured/judged" || column_matches("grasps/*/tolerance_used", name) ||
          column_matches("grasps/*/lost", name))
        chosen_[c] = true;
    }
  }

  void read_series() {
    const SeriesSelection& selected = result_.series = file_.keep.series;
    if (selected.worst_by.empty() || columns_.empty()) return;
    std::vector<std::string> column_names;
    for (std::size_t c = 0; c < columns_.size(); ++c) {
      column_names.push_back(columns_[c].name);
      if (columns_[c].name != selected.worst_by) continue;
      chosen_[c] = true;
      return;
    }
    const Node& worst = part(part(part(root_, "keep"), "series"), "worst");
    faults_.add(part(worst, "by").mark,
                fmt::format("no column {} for keep.series.worst.by{}", in_quotes(selected.worst_by),
                            suggestion(selected.worst_by, column_names, "columns")));
  }

  void select_columns() {
    if (!faults_.empty()) return;
    const std::vector<std::string> selected = names(true);
    for (const Condition& condition : conditions())
      result_.success.push_back(Criterion::parse(condition.text, selected, condition.name));
    for (std::size_t c = 0; c < columns_.size(); ++c) {
      if (chosen_[c]) result_.columns.push_back(std::move(columns_[c]));
    }
  }

  std::filesystem::path path_;
  CampaignFile file_;
  std::shared_ptr<CampaignPoints> points_;
  Node root_;
  FaultList faults_;
  Campaign result_;
  std::vector<Column> columns_;  // all available columns
  std::vector<bool> chosen_;
  std::string shas_;  // of the problems that were checked
  std::vector<DrawnPlace> drawn_;
  bool structure_is_sound_ = false, setters_agree_ = true;
  bool is_planned_ = false;  // at least one point of the design is planned before the cases
};

}  // namespace

Campaign load_campaign(const std::filesystem::path& path, std::vector<Fault>* warnings) {
  return load_campaign_with_points(path, warnings).campaign;
}

CampaignWithPoints load_campaign_with_points(const std::filesystem::path& path, std::vector<Fault>* warnings) {
  CampaignReader reader(path);
  Campaign campaign = reader.read(warnings);
  return {std::move(campaign), reader.points()};
}

}  // namespace grapnel
