#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <utility>

#include "grapnel/control/controller_signals.hpp"
#include "grapnel/scenario/schema.hpp"
#include "grapnel/scenario/sections.hpp"
#include "grapnel/text/csv_text.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

constexpr std::string_view kRateSuffix = ".rate";
constexpr std::array<std::string_view, 3> kTorqueColumns = {"base.x", "base.y", "base.z"};

// Whether this may be a name of the time column. First lines of other files are not shown in messages.
bool may_be_time(std::string_view text) {
  return text.size() <= 2 || !nearest(text, {"time", "times", "time_s", "time [s]", "seconds"}).empty();
}

// The meaning of a column of numbers.
struct CsvColumn {
  enum class Kind { unknown, time, position, rate, effort, base, wheel, gyro, thruster };
  Kind kind = Kind::unknown;
  std::size_t joint = 0;  // or axis, or which actuator
  std::string name;
  // Values beyond the joint's limits: the first is reported with their number.
  std::size_t beyond = 0;
  Mark first_beyond;
  double value_beyond = 0;
  std::vector<double> values = {};  // of an actuator, per row
};

class TrajectoryReader {
 public:
  /// The columns of joints.
  enum class Contents { motion, efforts };
  TrajectoryReader(const TrajectoryFile& file, const ReadRobot& robot, FaultList& faults,
                   Contents contents = Contents::motion)
      : file_(file), robot_(robot), faults_(faults), contents_(contents), csv_(file.text) {}

  std::optional<EffortLog> read_efforts() {
    auto motion = read();
    if (!motion) return {};
    EffortLog log{std::move(motion->times), std::move(motion->positions), {}};
    for (std::size_t i = 0; i < base_[0].size(); ++i)
      log.base_torque.push_back({base_[0][i], base_[1][i], base_[2][i]});
    log.wheel_torque = commanded(CsvColumn::Kind::wheel, log.times.size());
    log.gimbal_rate = commanded(CsvColumn::Kind::gyro, log.times.size());
    log.thruster = commanded(CsvColumn::Kind::thruster, log.times.size());
    return log;
  }

  std::optional<SampledMotion> read() {
    motion_.positions.resize(robot_.joints.size());
    motion_.rates.resize(robot_.joints.size());
    while (!faults_.full() && !foreign_ && (line_ = csv_.next()) != nullptr) read_line();
    if (!foreign_) check_whole();
    if (faults_.size() != before_ || !robot_.order_known) return {};
    const bool rates = std::any_of(columns_.begin(), columns_.end(),
                                   [](const CsvColumn& c) { return c.kind == CsvColumn::Kind::rate; });
    if (!rates) motion_.rates.clear();
    return std::move(motion_);
  }

 private:
  // ---- Actuators of the base ----

  // A kind of actuator: its command, and the limit of its values.
  struct Actuator {
    CsvColumn::Kind kind;
    SignalOwner owner;
    std::string_view limit;
    const CommandSignal& command() const {
      return *std::ranges::find(command_signals, owner, [](const CommandSignal& c) { return c.about.owner; });
    }
    std::string_view prefix() const { return command().column; }
    std::string unit() const { return fmt::format(" [{}]", signal_unit(command().about)); }
  };
  static constexpr std::array<Actuator, 3> kActuators{{
      {CsvColumn::Kind::wheel, SignalOwner::wheel, "the wheel's largest torque"},
      {CsvColumn::Kind::gyro, SignalOwner::gyro, "the gyro's largest gimbal rate"},
      {CsvColumn::Kind::thruster, SignalOwner::thruster, "the whole period"},
  }};
  static const Actuator* actuator(CsvColumn::Kind kind) {
    const auto at =
        std::find_if(kActuators.begin(), kActuators.end(), [&](const Actuator& a) { return a.kind == kind; });
    return at == kActuators.end() ? nullptr : &*at;
  }
  std::vector<std::string> actuator_names(CsvColumn::Kind kind) const {
    const RobotSetup& robot = robot_.setup;
    std::vector<std::string> names;
    const auto add = [&](const auto& list) {
      for (const auto& one : list) names.push_back(one.name);
    };
    if (kind == CsvColumn::Kind::wheel) add(robot.wheels);
    if (kind == CsvColumn::Kind::gyro) add(robot.gyros);
    if (kind == CsvColumn::Kind::thruster) add(robot.thrusters);
    return names;
  }
  double actuator_limit(const CsvColumn& column) const {
    const RobotSetup& robot = robot_.setup;
    if (column.kind == CsvColumn::Kind::wheel) return robot.wheels[column.joint].torque;
    return column.kind == CsvColumn::Kind::gyro ? robot.gyros[column.joint].rate : 1;
  }
  // Whether the column belongs to an actuator, or was intended to and has been reported.
  bool is_actuator(CsvColumn& column, const Mark& mark) {
    for (const Actuator& a : kActuators) {
      if (!column.name.starts_with(a.prefix())) continue;
      const std::string name = column.name.substr(a.prefix().size());
      const std::vector<std::string> names = actuator_names(a.kind);
      const auto at = std::find(names.begin(), names.end(), name);
      column.joint = static_cast<std::size_t>(at - names.begin());
      if (at != names.end()) {
        column.kind = a.kind;
      } else {
        const std::string kind(a.prefix().substr(0, a.prefix().size() - 1));
        faults_.add(mark, fmt::format("unknown column {}: the robot has no {} {}{}", in_quotes(column.name), kind,
                                      in_quotes(name), suggestion(name, names, kind + "s")));
      }
      return true;
    }
    return false;
  }
  void take_command(CsvColumn& column, double value, const CsvCell& field) {
    const bool within =
        column.kind == CsvColumn::Kind::thruster ? value >= 0 && value <= 1 : std::abs(value) <= actuator_limit(column);
    if (!within && column.beyond++ == 0) column.first_beyond = mark_at(field.begin), column.value_beyond = value;
    column.values.push_back(value);
  }
  // Values of a kind, per actuator, per row; actuators without a column get zero. Empty: no columns of this kind.
  std::vector<std::vector<double>> commanded(CsvColumn::Kind kind, std::size_t rows) const {
    std::vector<std::vector<double>> columns;
    for (const CsvColumn& column : columns_) {
      if (column.kind != kind) continue;
      columns.resize(actuator_names(kind).size(), std::vector<double>(rows, 0.0));
      columns[column.joint] = column.values;
    }
    return columns;
  }

  // ---- Lines ----

  void read_line() {
    const CsvLine* line = line_;
    if (columns_.empty()) {
      const CsvLine* header = is_number(line->cells[0]) ? commented_header() : nullptr;
      if (!header) {
        foreign_ = !has_commas();
        if (!foreign_) read_header(line->cells);
        return;
      }
      line_ = header;
      read_header(header->cells);
      line_ = line;
      if (foreign_) return;
    }
    read_sample(line->cells);
  }

  // "# time,shoulder,elbow", as numpy.savetxt writes it: the header, if the first line without a sign is a sample.
  const CsvLine* commented_header() const {
    const CsvLine* header = nullptr;
    for (const CsvLine& comment : csv_.comments()) {
      if (comment.cells.size() > 1 && comment.cells[0].text == "time") header = &comment;
    }
    return header;
  }
  bool is_number(const CsvCell& field) {
    scratch_.text.assign(field.text);
    return number_of(scratch_).has_value();
  }

  Mark mark_at(std::size_t bytes) const { return mark_in(*line_, bytes, file_.source); }

  // Some spreadsheets separate fields by semicolons and use decimal commas. One message covers all lines.
  bool has_commas() {
    const std::string_view line = line_->text;
    const std::size_t other = line.find_first_of(";\t");
    if (line.find(',') != std::string_view::npos || other == std::string_view::npos) return true;
    faults_.add(mark_at(other),
                fmt::format("fields must be separated by commas, not {}, and numbers must have decimal points",
                            line[other] == ';' ? "semicolons" : "tabs"));
    return false;
  }

  void read_header(const std::vector<CsvCell>& fields) {
    const Mark here = mark_at(fields[0].begin);
    if (fields[0].text != "time") {
      const bool shown = may_be_time(fields[0].text) || robot_.joint_index.contains(fields[0].text);
      faults_.add(here, shown ? fmt::format("the first column is {}, must be 'time'", in_quotes(fields[0].text))
                              : "not a trajectory: the first line must be time,<joint>,...");
      foreign_ = !shown;
      if (foreign_) return;
    }
    std::set<std::string_view> seen;
    for (std::size_t i = 0; i < fields.size(); ++i) {
      CsvColumn column;
      column.name = std::string(fields[i].text);
      if (i == 0)
        column.kind = CsvColumn::Kind::time;
      else
        identify(column, mark_at(fields[i].begin));
      if (!seen.insert(fields[i].text).second) {
        faults_.add(mark_at(fields[i].begin), fmt::format("duplicate column {}", in_quotes(fields[i].text)));
      }
      columns_.push_back(std::move(column));
    }
    check_columns(here, seen);
  }

  void identify(CsvColumn& column, const Mark& mark) {
    const auto known = [&](std::string_view joint) {
      const auto it = robot_.joint_index.find(joint);
      if (it != robot_.joint_index.end()) column.joint = it->second;
      return it != robot_.joint_index.end();
    };
    const std::string_view name = column.name;
    const bool is_motion = contents_ == Contents::motion;
    const bool is_rate = is_motion && name.ends_with(kRateSuffix);
    const auto axis = static_cast<std::size_t>(std::find(kTorqueColumns.begin(), kTorqueColumns.end(), name) -
                                               kTorqueColumns.begin());
    const std::string_view stem = is_rate ? name.substr(0, name.size() - kRateSuffix.size()) : name;
    if (known(name)) {
      column.kind = is_motion ? CsvColumn::Kind::position : CsvColumn::Kind::effort;
    } else if (is_rate && known(stem)) {
      column.kind = CsvColumn::Kind::rate;
    } else if (!is_motion && axis < kTorqueColumns.size()) {
      column.kind = CsvColumn::Kind::base, column.joint = axis;
    } else if (!is_motion && is_actuator(column, mark)) {
      return;
    } else if (robot_.fixed_joints.contains(name) || robot_.fixed_joints.contains(stem)) {
      faults_.add(mark, fmt::format("joint {} is fixed and has no column", in_quotes(stem)));
    } else if (robot_.count_known()) {
      std::vector<std::string> names = robot_.joint_names.names();
      if (is_rate) {
        for (std::string& joint : names) joint += kRateSuffix;
      }
      faults_.add(mark, fmt::format("unknown column {}{}", in_quotes(name), suggestion(name, names, "joints")));
    }
  }

  // Every joint has a column; of the rates all or none.
  void check_columns(const Mark& mark, const std::set<std::string_view>& seen) {
    const auto is_there = [&](std::string_view name) { return seen.contains(name); };
    if (contents_ == Contents::efforts && std::any_of(kTorqueColumns.begin(), kTorqueColumns.end(), is_there) &&
        !std::all_of(kTorqueColumns.begin(), kTorqueColumns.end(), is_there))
      faults_.add(mark, "the header has some of base.x, base.y and base.z, must have all or none");
    const auto commands_actuator = [](const CsvColumn& column) { return actuator(column.kind) != nullptr; };
    if (seen.contains(kTorqueColumns[0]) && std::any_of(columns_.begin(), columns_.end(), commands_actuator))
      faults_.add(mark,
                  "the header has base.x and columns of actuators that produce this torque; leave out one of them");
    if (!robot_.count_known()) return;
    std::vector<std::string> joints, rates;
    for (const JointDescription& joint : robot_.joints) {
      const std::string rate = joint.name + std::string(kRateSuffix);
      if (!seen.contains(joint.name)) joints.push_back(joint.name);
      if (!seen.contains(rate)) rates.push_back(rate);
    }
    if (!joints.empty()) faults_.add(mark, fmt::format("the header lacks joints: {}", some_of(joints)));
    const bool some_rate = std::any_of(columns_.begin(), columns_.end(),
                                       [](const CsvColumn& c) { return c.kind == CsvColumn::Kind::rate; });
    if (some_rate && !rates.empty()) {
      faults_.add(mark, fmt::format("the header has rates of some joints but lacks: {}", some_of(rates)));
    }
  }

  void read_sample(const std::vector<CsvCell>& fields) {
    if (fields.size() != columns_.size()) {
      faults_.add(mark_at(fields[0].begin),
                  fmt::format("the line has {}, must have {}", counted(fields.size(), "field"), columns_.size()));
      return;
    }
    for (std::size_t i = 0; i < fields.size(); ++i) {
      if (const auto value = number_in(fields[i], columns_[i])) take(columns_[i], *value, fields[i]);
    }
  }

  std::optional<double> number_in(const CsvCell& field, const CsvColumn& column) {
    scratch_.text.assign(field.text);
    const auto value = number_of(scratch_);
    const double largest = magnitudes_of(column.kind == CsvColumn::Kind::time ? "s" : "rad").largest;
    if (value && std::abs(*value) <= largest) return value;
    if (value && std::isfinite(*value)) {
      faults_.add(mark_at(field.begin), fmt::format("{} is {}, must be at most {:g} in magnitude{}",
                                                    shortened(column.name), field.text, largest, unit(column)));
      return {};
    }
    const std::string why = field.text.empty() ? ", not empty" : why_no_number(scratch_);
    faults_.add(
        mark_at(field.begin),
        value ? fmt::format("{} is {}, must be a finite number{}", shortened(column.name), field.text, unit(column))
              : fmt::format("{} must be a number{}{}", shortened(column.name), unit(column), why));
    return {};
  }

  static std::string unit(const CsvColumn& column) {
    switch (column.kind) {
      case CsvColumn::Kind::time:
        return " [s]";
      case CsvColumn::Kind::position:
        return " [rad or m]";
      case CsvColumn::Kind::rate:
        return " [rad/s or m/s]";
      case CsvColumn::Kind::effort:
        return " [N m or N]";
      case CsvColumn::Kind::base:
        return " [N m]";
      case CsvColumn::Kind::wheel:
      case CsvColumn::Kind::gyro:
      case CsvColumn::Kind::thruster:
        return actuator(column.kind)->unit();
      case CsvColumn::Kind::unknown:
        break;
    }
    return "";
  }

  void take(CsvColumn& column, double value, const CsvCell& field) {
    if (column.kind == CsvColumn::Kind::unknown) return;
    if (column.kind == CsvColumn::Kind::time) {
      if (motion_.times.empty() && value != 0) {
        faults_.add(mark_at(field.begin), fmt::format("the first time is {} [s], must be 0", value));
      } else if (!motion_.times.empty() && !(value > motion_.times.back())) {
        faults_.add(mark_at(field.begin), fmt::format("time is {} [s], must be greater than {} of the previous sample",
                                                      value, motion_.times.back()));
      }
      motion_.times.push_back(value);
      return;
    }
    if (column.kind == CsvColumn::Kind::base) return base_.at(column.joint).push_back(value);
    if (actuator(column.kind)) return take_command(column, value, field);
    const bool rate = column.kind == CsvColumn::Kind::rate;
    const JointLimits& limits = robot_.joints[column.joint].limits;
    const bool within = column.kind == CsvColumn::Kind::effort ? std::abs(value) <= limits.effort
                        : rate                                 ? std::abs(value) <= limits.rate
                                                               : value >= limits.lower && value <= limits.upper;
    if (!within && column.beyond++ == 0) {
      column.first_beyond = mark_at(field.begin);
      column.value_beyond = value;
    }
    (rate ? motion_.rates : motion_.positions)[column.joint].push_back(value);
  }

  void check_whole() {
    if (columns_.empty()) {
      faults_.add({file_.source, 1, 1}, "the file has no header line time,<joint>,...");
      return;
    }
    for (const CsvColumn& column : columns_) {
      if (column.beyond == 0) continue;
      const std::string more = column.beyond > 1 ? fmt::format(" (the first of {} such values)", column.beyond) : "";
      if (const Actuator* a = actuator(column.kind)) {
        const std::string bound = column.kind == CsvColumn::Kind::thruster
                                      ? "must be from 0 to 1, the share of a period for which the valve is open"
                                      : fmt::format("beyond {}, {}", a->limit, actuator_limit(column));
        faults_.add(column.first_beyond,
                    fmt::format("{} is {}, {}{}", shortened(column.name), column.value_beyond, bound, more));
        continue;
      }
      const JointLimits& limits = robot_.joints[column.joint].limits;
      const std::string bounds = column.kind == CsvColumn::Kind::rate ? fmt::format("rate limit {}", limits.rate)
                                 : column.kind == CsvColumn::Kind::effort
                                     ? fmt::format("effort limit {}", limits.effort)
                                     : fmt::format("limits {} to {}", limits.lower, limits.upper);
      faults_.add(column.first_beyond, fmt::format("{} is {}, beyond the joint's {}{}", shortened(column.name),
                                                   column.value_beyond, bounds, more));
    }
    // A line with an error may be the missing sample.
    if (motion_.times.size() < 2 && faults_.size() == before_) {
      faults_.add({file_.source, 1, 1},
                  fmt::format("the file has {}, must have at least 2", counted(motion_.times.size(), "sample")));
    }
  }

  const TrajectoryFile& file_;
  const ReadRobot& robot_;
  FaultList& faults_;
  const Contents contents_;
  CsvText csv_;
  const CsvLine* line_ = nullptr;  // the current line
  std::vector<CsvColumn> columns_;
  bool foreign_ = false;  // not a trajectory, already reported
  SampledMotion motion_;
  std::array<std::vector<double>, 3> base_;  // of a torque on the base, per row
  const std::size_t before_ = faults_.size();
  Node scratch_{Node::Kind::scalar, {}, {}, true, 0, {}, {}};
};

}  // namespace

std::optional<SampledMotion> read_trajectory(const TrajectoryFile& file, const ReadRobot& robot, FaultList& faults) {
  return TrajectoryReader(file, robot, faults).read();
}

std::optional<EffortLog> read_efforts(const TrajectoryFile& file, const ReadRobot& robot, FaultList& faults) {
  return TrajectoryReader(file, robot, faults, TrajectoryReader::Contents::efforts).read_efforts();
}

}  // namespace grapnel
