#include "grapnel/scenario/read_motion_pieces.hpp"

#include <fmt/format.h>

#include <cmath>

#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/scenario/joint_values.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

// How well a piece must begin with what the one before ends with [rad or m; rad/s or m/s].
constexpr double kSameMotion = 1e-6;

class PiecesReader {
 public:
  PiecesReader(const Node& list, const ReadRobot& robot, FaultList& faults)
      : list_(list), robot_(robot), faults_(faults), ends_(robot.joints.size()) {}

  std::vector<MotionPiece> read() {
    for (std::size_t i = 0; i < list_.items.size() && !faults_.full(); ++i) read_piece(i);
    if (in_doubt_ || faults_.size() != before_ || !robot_.order_known) return {};
    return std::move(pieces_);
  }

 private:
  void read_piece(std::size_t i) {
    const Node& node = list_.items[i];
    const std::string path = item("approach.pieces", i);
    MotionPiece piece;
    piece.until = number_at(node, "until").value_or(0);
    const double begin = i == 0 ? 0 : pieces_.back().until;
    if (i > 0 && piece.until > 0 && piece.until <= begin) {
      faults_.add(
          part(node, "until").mark,
          fmt::format("{}.until is {} [s], must be greater than {} of the piece before", path, piece.until, begin));
    }
    const Node& series = part(node, "series");
    const std::vector<const Node*> nodes = joint_nodes(series, below(path, "series"), robot_, faults_);
    for (const Node* one : nodes) piece.series.push_back(coefficients(*one));
    in_doubt_ = in_doubt_ || !(piece.until > begin) || nodes.size() != robot_.joints.size();
    for (std::size_t j = 0; j < nodes.size() && !in_doubt_; ++j) {
      check_meeting(begin, piece, j, nodes[j]->mark,
                    fmt::format("{}.series of joint {}", path, in_quotes(robot_.joints[j].name)));
    }
    pieces_.push_back(std::move(piece));
  }

  std::vector<double> coefficients(const Node& node) {
    const auto numbers = node.is_sequence() ? numbers_in(node) : std::nullopt;
    if (!numbers) in_doubt_ = true;  // reported by the schema
    return numbers.value_or(std::vector<double>{});
  }

  // A jump would be an impulse from nowhere.
  void check_meeting(double begin, const MotionPiece& piece, std::size_t joint, const Mark& mark,
                     const std::string& name) {
    JointTrajectory trajectory;
    trajectory.pieces.push_back({begin, piece.until, ChebyshevPiece{piece.series[joint]}});
    const JointPoint first = evaluate(trajectory, begin), last = evaluate(trajectory, piece.until);
    JointPoint& before = ends_[joint];
    for (const double x : {first.position, first.rate, last.position, last.rate}) {
      if (std::isfinite(x)) continue;
      faults_.add(mark, name + " gives positions or rates that no number can hold");
      return;
    }
    if (!pieces_.empty()) {
      check_same(first.position, before.position, mark, name, "at");
      check_same(first.rate, before.rate, mark, name, "with the rate");
    }
    before = last;
  }

  void check_same(double here, double before, const Mark& mark, const std::string& name, const char* what) {
    if (std::abs(here - before) <= kSameMotion) return;
    faults_.add(mark, fmt::format("{} begins {} {}, but the piece before ends {} {}; make them agree within {}", name,
                                  what, here, what, before, kSameMotion));
  }

  const Node& list_;
  const ReadRobot& robot_;
  FaultList& faults_;
  const std::size_t before_ = faults_.size();
  std::vector<MotionPiece> pieces_;
  std::vector<JointPoint> ends_;  // per joint: of the piece before
  bool in_doubt_ = false;
};

}  // namespace

std::vector<MotionPiece> read_motion_pieces(const Node& list, const ReadRobot& robot, FaultList& faults) {
  return PiecesReader(list, robot, faults).read();
}

}  // namespace grapnel
