#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <stdexcept>

#include "grapnel/campaign/axis.hpp"
#include "grapnel/campaign/changed_scenario.hpp"
#include "grapnel/campaign/grid.hpp"
#include "grapnel/campaign/study_document.hpp"
#include "grapnel/campaign/study_files.hpp"
#include "grapnel/result/file_seal.hpp"
#include "grapnel/scenario/reader.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/text_file.hpp"

namespace grapnel {
namespace {

constexpr std::size_t kMostPoints = 10'000'000;

using Position = std::vector<std::size_t>;

// The points of a study, from trees. Thread safety: problem() from any thread, once the files have been read.
class Points {
 public:
  std::filesystem::path file;  // of the study
  std::string scenario;        // path in the study file; may be empty
  std::vector<Change> set;
  std::vector<ReadAxis> axes;

  /// The scenario at a position before any quantity is applied. @throws InputError
  std::shared_ptr<const CaptureProblem> problem(std::span<const std::size_t> at) {
    Position key;
    for (std::size_t a = 0; a < axes.size(); ++a) {
      if (!axes[a].quantity) key.push_back(at[a]);
    }
    if (auto stored = find(key)) return stored;
    const Changed changed = changes(at);
    auto made = std::make_shared<const CaptureProblem>(load_scenario(changed.scenario, changed.changes, files_));
    store(key, made);
    return made;
  }

  std::vector<Fault> warnings(std::span<const std::size_t> at) {
    const Changed changed = changes(at);
    std::vector<Fault> found;
    load_scenario(changed.scenario, changed.changes, files_, &found);
    return found;
  }

  StudyCase point(std::span<const std::size_t> at) {
    const auto base = problem(at);
    StudyCase result{*base, inward_normals(*base)};
    apply_quantities(quantities_at(axes, at), result.problem);
    return result;
  }

  std::string scenario_text(std::span<const std::size_t> at, const std::filesystem::path& place,
                            const std::string& comment) {
    const auto before = problem(at);
    StudyCase after = point(at);
    preserve_normals(*before, after);
    const Changed changed = changes(at);
    std::string suffix;
    for (std::size_t a = 0; a < axes.size(); ++a) suffix += ", " + shown(axes[a].shown, at[a]);
    return changed_scenario_text({changed.scenario, changed_tree(changed.scenario, changed.changes, files_), *before},
                                 after.problem, place, suffix, comment);
  }

 private:
  struct Changed {
    std::filesystem::path scenario;
    std::vector<Change> changes;
  };
  Changed changes(std::span<const std::size_t> at) const {
    std::string named = scenario;
    for (std::size_t a = 0; a < axes.size(); ++a) {
      const ReadAxisValue& value = axes[a].values[at[a]];
      if (!value.scenario.empty()) named = value.scenario;
    }
    return {path_beside(file, named), changes_at(set, axes, at)};
  }

  // "relative_speed 0.1 m/s"
  static std::string shown(const StudyAxis& axis, std::size_t at) {
    if (!axis.is_numeric) return axis.values[at].label;
    return fmt::format("{} {:.9g}{}", axis.name, axis.values[at].number,
                       axis.unit.empty() || axis.unit == "1" ? "" : " " + axis.unit);
  }

  // Neighbouring points often differ only in quantities.
  static constexpr std::size_t kMaxStored = 64;

  std::shared_ptr<const CaptureProblem> find(const Position& key) {
    const std::lock_guard lock(mutex_);
    const auto it = stored_.find(key);
    return it == stored_.end() ? nullptr : it->second;
  }
  void store(const Position& key, std::shared_ptr<const CaptureProblem> made) {
    const std::lock_guard lock(mutex_);
    if (!stored_.emplace(key, std::move(made)).second) return;
    order_.push_back(key);
    if (order_.size() <= kMaxStored) return;
    stored_.erase(order_.front());
    order_.pop_front();
  }

  ScenarioFiles files_;
  std::mutex mutex_;
  std::map<Position, std::shared_ptr<const CaptureProblem>> stored_;  // guarded by mutex_, as order_
  std::deque<Position> order_;
};

class StudyReader {
 public:
  explicit StudyReader(const std::filesystem::path& path) : path_(path), points_(std::make_shared<Points>()) {}

  Campaign read(std::vector<Fault>* warnings) {
    StudyFile file;
    StudyDocument document = read_document(path_, file, faults_);
    root_ = std::move(document.root);
    structure_is_sound_ = document.sound;
    points_->file = path_;
    points_->scenario = file.scenario;
    points_->set = read_changes(part(root_, "set"));
    study_.kind = CampaignKind::sweep;
    study_.cases = 1;
    study_.name = file.name;
    study_.file = path_.string();
    study_.text = std::move(document.bytes);
    study_.mode = file.simulate;
    take_axes(file);
    check_scenarios_named();
    if (can_make_points()) check_points();
    choose_columns();
    faults_.throw_if_any();
    if (warnings) *warnings = points_->warnings(Position(points_->axes.size(), 0));
    study_.sha256 = sha256(study_.text + shas_);
    std::vector<std::size_t> sizes;
    for (const StudyAxis& axis : study_.design) sizes.push_back(axis.values.size());
    study_.problem = [points = points_, sizes](std::uint64_t k) { return points->point(grid_position(sizes, k)); };
    study_.scenario_text = [points = points_, sizes](std::uint64_t k, const std::filesystem::path& place,
                                                     const std::string& comment) {
      return points->scenario_text(grid_position(sizes, k), place, comment);
    };
    return std::move(study_);
  }

 private:
  void take_axes(const StudyFile& file) {
    const Node& list = part(root_, "axes");
    points_->axes = read_axes(file.axes, list, "axes", faults_);
    double points = 1;
    for (const ReadAxis& axis : points_->axes) {
      points *= static_cast<double>(axis.shown.values.size());
      study_.design.push_back(axis.shown);
    }
    if (points > static_cast<double>(kMostPoints))
      faults_.add(list.mark, fmt::format("the axes give {:.6g} points, the limit is {}", points, kMostPoints));
  }

  // Checks that every point has exactly one scenario, and that the files can be read.
  void check_scenarios_named() {
    const ReadAxis* naming = nullptr;
    bool always = !points_->scenario.empty();
    if (always) expect_file(points_->scenario, part(root_, "scenario").mark);
    for (const ReadAxis& axis : points_->axes) {
      std::size_t named = 0;
      for (const ReadAxisValue& value : axis.values) {
        if (value.scenario.empty()) continue;
        ++named;
        expect_file(value.scenario, value.scenario_mark);
        if (naming && naming != &axis) {
          faults_.add(value.scenario_mark, fmt::format("{} names scenarios, as {} does", axis.place, naming->place));
          break;
        }
        naming = &axis;
      }
      always = always || (named > 0 && named == axis.values.size());
    }
    if (!always && root_.is_mapping())
      faults_.add(root_.mark, "missing key 'scenario' in the study: the axes do not give a scenario for every point");
  }

  void expect_file(const std::string& named, const Mark& mark) {
    const std::size_t before = faults_.size();
    read_file(path_beside(path_, named), mark, faults_, kLargestFile, named);
    files_are_there_ = files_are_there_ && faults_.size() == before;
  }

  bool can_make_points() const {
    const auto has_values = [](const ReadAxis& axis) { return !axis.values.empty(); };
    return files_are_there_ && structure_is_sound_ && (!points_->scenario.empty() || faults_.empty()) &&
           std::all_of(points_->axes.begin(), points_->axes.end(), has_values);
  }

  // Each axis by itself, the others at their first values.
  void check_points() {
    Position at(points_->axes.size(), 0);
    const auto base = check_problem(at);
    if (base) check_quantities(*base, true);
    for (std::size_t a = 0; a < at.size(); ++a) {
      const ReadAxis& axis = points_->axes[a];
      if (axis.quantity) continue;
      for (const std::size_t value : checked_values(axis)) {
        at[a] = value;
        if (value == 0 || faults_.full()) continue;
        if (const auto problem = check_problem(at)) check_quantities(*problem, false);
      }
      at[a] = 0;
    }
  }

  static std::vector<std::size_t> checked_values(const ReadAxis& axis) {
    if (axis.is_range) return {0, axis.values.size() - 1};
    std::vector<std::size_t> all(std::min(axis.values.size(), kMostChecked));
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = i;
    return all;
  }

  std::shared_ptr<const CaptureProblem> check_problem(const Position& at) {
    try {
      auto problem = points_->problem(at);
      merge_columns(columns_, offered_columns(*problem, study_.mode == StudyMode::run));
      shas_ += problem->sha256;
      expect_impact(study_.mode, *problem, root_, faults_);
      return problem;
    } catch (const InputError& error) {
      for (const Fault& fault : error.faults()) add_once(fault, faults_);
    }
    return nullptr;
  }

  // Quantities one by one, with all their checked values or only the first.
  void check_quantities(const CaptureProblem& problem, bool all) {
    for (const ReadAxis& axis : points_->axes) {
      if (!axis.quantity || !expect_name(axis, problem)) continue;
      for (const std::size_t value : checked_values(axis)) {
        if (value > 0 && !all) break;
        CaptureProblem copy = problem;
        const QuantityValue set{*axis.quantity, axis.values[value].quantity};
        try {
          apply_quantities({&set, 1}, copy);
        } catch (const std::exception& error) {
          add_once(axis.values[value].mark,
                   fmt::format("{}: {} (scenario {})", axis.place, error.what(), in_quotes(problem.name)), faults_);
          break;
        }
      }
    }
  }

  bool expect_name(const ReadAxis& axis, const CaptureProblem& problem) {
    return expect_grasp_or_target(axis.quantity->of, axis.of_mark, axis.place, info(axis.quantity->kind).of_grasp,
                                  problem, faults_);
  }

  void choose_columns() {
    const std::vector<bool> chosen = chosen_columns(part(root_, "columns"), columns_, faults_);
    for (std::size_t c = 0; c < columns_.size(); ++c) {
      if (chosen[c]) study_.columns.push_back(std::move(columns_[c]));
    }
  }

  std::filesystem::path path_;
  std::shared_ptr<Points> points_;
  Node root_;
  FaultList faults_;
  Campaign study_;
  std::vector<Column> columns_;
  std::string shas_;  // of the problems that were checked
  bool structure_is_sound_ = false, files_are_there_ = true;
};

}  // namespace

Campaign load_study(const std::filesystem::path& path, std::vector<Fault>* warnings) {
  return StudyReader(path).read(warnings);
}

}  // namespace grapnel
