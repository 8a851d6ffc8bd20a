#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>

#include "grapnel/campaign/campaign_points.hpp"
#include "grapnel/campaign/changed_scenario.hpp"
#include "grapnel/campaign/sensitivities.hpp"
#include "grapnel/campaign/study_document.hpp"
#include "grapnel/campaign/study_files.hpp"
#include "grapnel/scenario/imported_robot.hpp"
#include "grapnel/scenario/reader.hpp"
#include "grapnel/scenario/schema.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/parse_yaml.hpp"
#include "grapnel/text/text_file.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

// Outcomes without --of.
constexpr const char* kMainColumns[] = {"grasps/*/impulse_magnitude",
                                        "grasps/*/angular_impulse_magnitude",
                                        "grasps/*/peak_force",
                                        "grasps/*/position_error",
                                        "base/velocity_change",
                                        "base/angular_velocity_change",
                                        "worst_margin",
                                        "end/base/angular_velocity",
                                        "end/base/attitude_error",
                                        "end/joints/*/velocity",
                                        "phases/*/duration",
                                        "detumbling/duration",
                                        "rest/time",
                                        "wheels/*/rate",
                                        "thrusters/propellant",
                                        "clearance/minimum",
                                        "contacts/impulse",
                                        "contacts/peak_force"};

// Values without --by, as far as the scenario states them as numbers: below a target, and below the scenario.
constexpr const char* kValuesOfTargets[] = {"mass", "inertia.xx", "inertia.yy", "inertia.zz", "state.angular_velocity"};
constexpr const char* kValuesOfScenario[] = {"approach.straight_in.final_speed",
                                             "impact.restitution",
                                             "impact.friction",
                                             "impact.duration",
                                             "approach.tracking.kp",
                                             "approach.tracking.kd"};
constexpr const char* kGains[] = {"kp", "kd"};  // of phases after the impact

constexpr const char* kNoColumns = "the scenario has none of the default columns; name some by --of COLUMNS";

// Sizes of zeros, by unit: the first step is a hundredth of it.
double size_of_zero(const std::string& unit) {
  if (unit == "m" || unit == "rad" || unit == "m/s" || unit == "rad/s") return 0.1;
  return 1;
}

Mark mark_of_option(const char* option, const std::string& text) {
  return {std::make_shared<const std::string>(std::string(option) + " " + text), 0, 0};
}

Node patterns_node(const std::vector<std::string>& patterns) {
  Node list;
  list.kind = Node::Kind::sequence;
  for (const std::string& pattern : patterns) {
    const Mark mark = mark_of_option("--of", pattern);
    if (!pattern.empty()) list.items.push_back(text_node(pattern, mark));
  }
  return list;
}

// Columns in the order of the patterns, or the main columns.
std::vector<Column> outcomes(const std::vector<std::string>& patterns, const std::vector<Column>& columns,
                             FaultList& faults) {
  if (!patterns.empty()) chosen_columns(patterns_node(patterns), columns, faults);  // reports unknown ones
  const std::vector<std::string> main(std::begin(kMainColumns), std::end(kMainColumns));
  std::vector<Column> selected;
  for (const std::string& pattern : patterns.empty() ? main : patterns) {
    std::vector<Column> matching;
    std::ranges::copy_if(columns, std::back_inserter(matching),
                         [&](const Column& column) { return column_matches(pattern, column.name); });
    merge_columns(selected, matching);
  }
  return selected;
}

// ---- Values of a task, from the points of a campaign ----

// Runs the cases of a campaign's points at chosen numbers.
class VariedPoints {
 public:
  VariedPoints(std::shared_ptr<CampaignPoints> points, std::vector<ReadUncertain> values)
      : points_(std::move(points)), values_(std::move(values)) {}

  StudyCase at(std::span<const double> numbers) const {
    const auto design = points_->design_point(0);
    CampaignPoints::Draw draw;
    std::size_t begin = 0;
    for (std::size_t i = 0; i < values_.size(); ++i) {
      const std::size_t n = counts_[i];
      draw.values.push_back(
          {placed_numbers(values_[i].value, design->forms[i].nominal, numbers.subspan(begin, n)), {}});
      begin += n;
    }
    StudyCase result{points_->read(*design, draw), {}};
    result.inward_normals = inward_normals(result.problem);
    return result;
  }

  // Adds the values to the task; those without a mean are held. `deviates`: the deviations are stated.
  void add_to(SensitivityTask& task, bool deviates, FaultList& faults) {
    const auto design = points_->design_point(0);
    std::vector<double> blocks;  // covariance of each
    std::size_t total = 0;
    std::vector<ValueMoments> all;
    for (std::size_t i = 0; i < values_.size(); ++i) {
      const UncertainForm& form = design->forms[i];
      auto moments = moments_of(values_[i].value, form.nominal);
      if (!moments) {
        hold(values_[i], form, task, faults);
        moments.emplace();
      }
      const std::size_t n = moments->mean.size();
      counts_.push_back(n);
      for (std::size_t k = 0; k < n; ++k)
        task.values.push_back(value(values_[i], form, *moments, k, *design, deviates));
      total += n;
      all.push_back(std::move(*moments));
    }
    if (!deviates) return;
    task.covariance.assign(total * total, 0.0);
    std::size_t begin = 0;
    for (const ValueMoments& moments : all) {
      const std::size_t n = moments.mean.size();
      for (std::size_t k = 0; k < n * n; ++k)
        task.covariance[(begin + k / n) * total + begin + k % n] = moments.covariance[k];
      begin += n;
    }
  }

 private:
  // A random direction or orientation, a whole number or a choice.
  static void hold(const ReadUncertain& read, const UncertainForm& form, SensitivityTask& task, FaultList& faults) {
    const std::string path = shortened(read.where.paths[0]);
    if (form.is_absent && read.choices.empty()) {
      faults.add(read.where.mark,
                 fmt::format("{}: {} has no mean to differentiate at, and the scenario has no value there; add one by "
                             "'set'",
                             read.where.place, path));
      return;
    }
    task.notes.push_back(fmt::format("{} has no mean, and is held at {}: its uncertainty is not contained", path,
                                     read.choices.empty() ? "the scenario's value" : "its most probable choice"));
  }

  static SensitivityValue value(const ReadUncertain& read, const UncertainForm& form, const ValueMoments& moments,
                                std::size_t k, const DesignPoint& design, bool deviates) {
    SensitivityValue one;
    const CampaignInput input = name_of_number(read, form, k, design);
    one.name = input.name, one.unit = input.unit, one.description = input.description;
    one.value = moments.mean[k];
    const std::size_t n = moments.mean.size();
    if (deviates) one.deviation = std::sqrt(moments.covariance[k * n + k]);
    double size = std::abs(one.value);
    if (size == 0 && std::holds_alternative<IndependentNumbers>(read.value)) {
      for (const double other : moments.mean) size = std::max(size, std::abs(other));
    }
    one.size = size > 0 ? size : one.deviation && *one.deviation > 0 ? *one.deviation : size_of_zero(one.unit);
    const bool is_number =
        std::holds_alternative<IndependentNumbers>(read.value) || std::holds_alternative<CorrelatedNumbers>(read.value);
    // The numbers of several paths may have different bounds, which runs report as invalid values.
    if (!is_number || read.where.paths.size() > 1) return one;
    FaultList found_before;
    const PlaceRule rule =
        place_rule(path_steps(design.filled, read.where.paths[0], read.where.path_marks[0], found_before));
    one.least = std::max({rule.above, rule.from, -rule.largest});
    one.most = std::min(rule.to, rule.largest);
    return one;
  }

  static CampaignInput name_of_number(const ReadUncertain& read, const UncertainForm& form, std::size_t k,
                                      const DesignPoint& design) {
    if (const auto* tilt = std::get_if<TiltedVector>(&read.value)) {
      const std::string& path = read.where.paths[0];
      const bool tilts = tilt->deviation > 0;
      if (tilts && k < 2) return {fmt::format("{}/tilt_{}", path, k + 1), "rad", "tilt of the vector about an axis"};
      return {path + "/factor", "1", "factor on the length of the vector"};
    }
    const std::vector<CampaignInput> inputs = inputs_of(read, form, design.filled, design.problem);
    return inputs.at(k);
  }

  std::shared_ptr<CampaignPoints> points_;
  std::vector<ReadUncertain> values_;
  std::vector<std::size_t> counts_;  // numbers of each
};

void take_problem(std::shared_ptr<VariedPoints> varied, SensitivityTask& task) {
  task.problem = [varied = std::move(varied)](std::span<const double> numbers) { return varied->at(numbers); };
}

// ---- Scenarios ----

class ScenarioReader {
 public:
  ScenarioReader(const std::filesystem::path& file, const SensitivityChoice& choice)
      : file_(file), choice_(choice), points_(std::make_shared<CampaignPoints>()) {}

  SensitivityTask read(std::vector<Fault>* warnings) {
    SensitivityTask task;
    task.file = file_.string(), task.mode = choice_.mode, task.plan = choice_.plan;
    points_->scenario = file_;
    points_->set = changes_of(choice_.overrides, faults_);
    if (choice_.text) store_text();
    points_->plan_once = false;  // until paths have been checked: planning takes long
    faults_.throw_if_any();
    const CaptureProblem problem = points_->before_quantities({}, warnings);
    task.name = problem.name, task.sha256 = problem.sha256;
    if (choice_.mode == StudyMode::impact && !problem.impact)
      faults_.add({std::make_shared<const std::string>("--impact"), 0, 0},
                  fmt::format("needs a scenario with 'impact', {} has none", in_quotes(problem.name)));
    task.columns = outcomes(choice_.of, offered_columns(problem, choice_.mode == StudyMode::run), faults_);
    if (task.columns.empty() && faults_.empty()) faults_.add(mark_of_option("--of", ""), kNoColumns);
    task.drops_absent = choice_.of.empty();
    const auto varied = varied_points(problem);
    faults_.throw_if_any();
    varied->add_to(task, false, faults_);
    faults_.throw_if_any();
    if (task.values.empty())
      faults_.add(mark_of_option("--by", ""), "the scenario has none of the default values; name some by --by PATH");
    faults_.throw_if_any();
    take_problem(varied, task);
    return task;
  }

 private:
  void store_text() {
    const auto source = std::make_shared<const std::string>(file_.string());
    const auto text = checked_text(*choice_.text, source, faults_);
    auto tree = text ? parse_document(*text, source, faults_) : std::nullopt;
    faults_.throw_if_any();
    points_->files.store(file_, {*choice_.text, {}, std::move(*tree)});
  }

  std::shared_ptr<VariedPoints> varied_points(const CaptureProblem& problem) {
    std::vector<ReadUncertain> values;
    std::vector<UncertainPaths> paths;
    for (const std::string& path : choice_.by.empty() ? default_paths(problem) : choice_.by) {
      UncertainPaths where;
      where.mark = mark_of_option("--by", path), where.place = path;
      where.paths = {path}, where.path_marks = {where.mark};
      where.is_orientation = path.ends_with(".quaternion_wxyz");
      if (is_sound(where)) paths.push_back(where);
    }
    if (!faults_.empty()) return nullptr;
    points_->paths = std::move(paths);
    points_->plan_once = choice_.plan == CampaignPlan::nominal;
    points_->forget();
    const auto design = points_->design_point(0);
    expect_different(points_->paths, design->filled);
    for (std::size_t i = 0; i < points_->paths.size(); ++i) {
      ReadUncertain one;
      one.where = points_->paths[i];
      if (one.where.is_orientation)
        one.value = UncertainRotation{false, 1};
      else
        one.value =
            IndependentNumbers{std::vector<NumberDistribution>(design->forms[i].nominal.size(),
                                                               {NumberDistribution::Kind::normal, 0, 1, 0, 0, false}),
                               ValueForm::value};
      one = centered(std::move(one), design->forms[i].nominal);
      points_->uncertain.push_back(one);
      values.push_back(std::move(one));
    }
    return std::make_shared<VariedPoints>(points_, std::move(values));
  }

  // Of two paths to one value, the last would silently win.
  void expect_different(const std::vector<UncertainPaths>& places, const Node& scenario) {
    std::vector<std::vector<PathStep>> all;
    for (const UncertainPaths& where : places) {
      const std::string& path = where.paths[0];
      FaultList found_before;
      std::vector<PathStep> steps = path_steps(scenario, path, where.mark, found_before);
      for (std::size_t i = 0; i < all.size(); ++i) {
        const Overlap how = overlap(steps, all[i]);
        if (how == Overlap::none) continue;
        const char* relation = how == Overlap::same   ? "is the same value as"
                               : how == Overlap::part ? "is a part of"
                                                      : "contains";
        faults_.add(where.mark, fmt::format("{} {}", relation, shortened(places[i].paths[0])));
      }
      all.push_back(std::move(steps));
    }
  }

  // The numbers of the scenario as means.
  static ReadUncertain centered(ReadUncertain one, const std::vector<double>& nominal) {
    if (auto* numbers = std::get_if<IndependentNumbers>(&one.value)) {
      for (std::size_t k = 0; k < nominal.size(); ++k) numbers->distributions[k].location = nominal[k];
    }
    return one;
  }

  // Checks a path alone, so that every wrong one is reported.
  bool is_sound(const UncertainPaths& where) {
    points_->paths = {where};
    points_->forget();
    try {
      const auto design = points_->design_point(0);
      return !report_unknown_keys(where, design->filled, faults_) && has_numbers(where, design->forms[0]);
    } catch (const InputError& error) {
      for (const Fault& fault : error.faults()) add_once(fault, faults_);
      return false;
    }
  }

  bool has_numbers(const UncertainPaths& where, const UncertainForm& form) {
    const std::string& path = where.paths[0];
    if (form.is_absent) {
      faults_.add(where.mark, fmt::format("the scenario has no value at {}; add one by --set {}=VALUE", shortened(path),
                                          shortened(path)));
      return false;
    }
    if (!form.nominal.empty()) return true;
    faults_.add(where.mark, fmt::format("the scenario has {} at {}, expected finite numbers", described(form.forms[0]),
                                        shortened(path)));
    return false;
  }

  std::vector<std::string> default_paths(const CaptureProblem& problem) {
    Node tree = changed_tree(file_, points_->set, points_->files);
    take_units(tree);
    std::vector<std::string> paths;
    const auto add = [&](const std::string& path) {
      const auto value = value_at(tree, path);
      if (value && numbers_in(*value)) paths.push_back(path);
    };
    for (std::size_t i = 0; i < problem.targets.size(); ++i) {
      const std::string& name = problem.targets[i].name;
      const bool is_plain = name.find_first_of(".[]") == std::string::npos;
      const std::string of = is_plain ? "targets." + name : fmt::format("targets[{}]", i);
      for (const char* key : kValuesOfTargets) add(of + "." + key);
    }
    for (const char* path : kValuesOfScenario) add(path);
    for (const char* section : {"post_impact", "motion"}) {
      const auto phases = value_at(tree, section);
      if (!phases) continue;
      const std::size_t count = phases->is_sequence() ? phases->items.size() : 1;
      for (std::size_t i = 0; i < count; ++i) {
        const std::string of = phases->is_sequence() ? fmt::format("{}[{}]", section, i) : std::string(section);
        for (const char* key : kGains) {
          const auto value = value_at(tree, of + "." + key);
          if (value && value->is_scalar()) add(of + "." + key);  // a list has one gain per joint
        }
      }
    }
    return paths;
  }

  std::filesystem::path file_;
  const SensitivityChoice& choice_;
  std::shared_ptr<CampaignPoints> points_;
  FaultList faults_;
};

// ---- Campaigns ----

// Columns that limits of criteria read.
void take_criteria(const Campaign& campaign, const std::vector<Column>& offered, const std::vector<std::string>& of,
                   SensitivityTask& task) {
  std::vector<std::string> campaign_names;
  for (const Column& column : campaign.columns) campaign_names.push_back(column.name);
  const auto has = [&](const std::string& name) {
    return std::ranges::any_of(task.columns, [&](const Column& one) { return one.name == name; });
  };
  for (const Criterion& criterion : campaign.success) {
    const bool of_columns = std::ranges::all_of(
        criterion.limits(), [&](const CriterionLimit& limit) { return limit.number < campaign_names.size(); });
    if (criterion.limits().empty() || !of_columns) {
      task.unjudged.push_back(criterion.name());
      continue;
    }
    for (const CriterionLimit& limit : criterion.limits()) {
      const std::string& name = campaign_names[limit.number];
      const auto column = std::ranges::find_if(offered, [&](const Column& one) { return one.name == name; });
      if (of.empty() && !has(name) && column != offered.end()) task.columns.push_back(*column);
    }
    if (std::ranges::all_of(criterion.limits(),
                            [&](const CriterionLimit& limit) { return has(campaign_names[limit.number]); }))
      task.criteria.push_back(criterion);
    else
      task.unjudged.push_back(criterion.name());
  }
  // Their numbers are the task's columns from now on.
  std::vector<std::string> names;
  for (const Column& column : task.columns) names.push_back(column.name);
  for (Criterion& criterion : task.criteria) criterion = Criterion::parse(criterion.text(), names, criterion.name());
}

SensitivityTask read_campaign_task(const std::filesystem::path& file, const SensitivityChoice& choice,
                                   std::vector<Fault>* warnings) {
  FaultList faults;
  const Mark whole{std::make_shared<const std::string>(file.string()), 0, 0};
  for (const std::string& path : choice.by)
    faults.add(mark_of_option("--by", path), "the values of a campaign file are those of its key 'uncertain'");
  for (const Override& one : choice.overrides)
    faults.add({std::make_shared<const std::string>(override_text(one)), 0, 0},
               "a campaign file has no --set; use its key 'set'");
  faults.throw_if_any();
  const CampaignWithPoints read = load_campaign_with_points(file, warnings);
  const Campaign& campaign = read.campaign;
  if (!campaign.design.empty())
    faults.add(whole, "the campaign has a 'design', and so several nominal captures; use 'set' for one of them");
  if (read.points->uncertain.empty()) faults.add(whole, "the campaign has no uncertain values");
  faults.throw_if_any();
  SensitivityTask task;
  task.name = campaign.name, task.file = file.string(), task.sha256 = campaign.sha256, task.is_campaign = true;
  task.mode = campaign.mode, task.plan = campaign.plan;
  const auto design = read.points->design_point(0);
  const std::vector<Column> offered = offered_columns(design->problem, campaign.mode == StudyMode::run);
  task.columns = outcomes(choice.of, offered, faults);
  task.drops_absent = choice.of.empty();
  faults.throw_if_any();
  take_criteria(campaign, offered, choice.of, task);
  if (task.columns.empty()) faults.add(mark_of_option("--of", ""), kNoColumns);
  auto varied = std::make_shared<VariedPoints>(read.points, read.points->uncertain);
  varied->add_to(task, true, faults);
  if (task.values.empty() && faults.empty()) faults.add(whole, "no uncertain value has a mean to differentiate at");
  faults.throw_if_any();
  take_problem(std::move(varied), task);
  return task;
}

bool is_campaign_file(const std::filesystem::path& file) {
  FaultList unused;
  const auto source = std::make_shared<const std::string>(file.string());
  const auto bytes = read_file(file, {source, 0, 0}, unused);
  const auto text = bytes ? checked_text(*bytes, source, unused) : std::nullopt;
  const auto tree = text ? parse_document(*text, source, unused) : std::nullopt;
  return tree && tree->is_mapping() && text_at(*tree, "schema").starts_with("grapnel-campaign/");
}

}  // namespace

SensitivityTask load_sensitivities(const std::filesystem::path& file, const SensitivityChoice& choice,
                                   std::vector<Fault>* warnings) {
  return !choice.text && is_campaign_file(file) ? read_campaign_task(file, choice, warnings)
                                                : ScenarioReader(file, choice).read(warnings);
}

}  // namespace grapnel
