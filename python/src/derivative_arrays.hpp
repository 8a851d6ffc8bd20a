#pragma once

/// @file
/// Arguments and results of derivatives of the dynamics.

#include <algorithm>
#include <string>
#include <vector>

#include "grapnel/dynamics/dynamics_derivatives.hpp"
#include "robot.hpp"

namespace grapnel::python {

/// Arrays of one case each after another, and the position of the next case in them.
struct Matrices {
  Matrices(const Cases& cases, py::ssize_t rows, py::ssize_t columns)
      : array(results(cases, {rows, columns})),
        data(array.mutable_data()),
        size(static_cast<std::size_t>(rows * columns)) {}
  void put(std::int64_t i, const RowMatrix& matrix) { std::copy_n(matrix.data(), size, at(i)); }
  double* at(std::int64_t i) const { return data + static_cast<std::size_t>(i) * size; }
  py::array_t<double> array;
  double* data;
  std::size_t size;
};
struct Vectors {
  Vectors(const Cases& cases, py::ssize_t width)
      : array(results(cases, {width})), data(array.mutable_data()), size(static_cast<std::size_t>(width)) {}
  void put(std::int64_t i, const std::vector<double>& x) { std::copy_n(x.data(), size, at(i)); }
  double* at(std::int64_t i) const { return data + static_cast<std::size_t>(i) * size; }
  py::array_t<double> array;
  double* data;
  std::size_t size;
};

inline void put_state(const Robot& robot, const Rows& q, const Rows& v, std::int64_t i, State& state) {
  robot.put_coordinates(q, i, state.q.data());
  std::copy_n(v.row(i), v.width(), state.v.begin());
}

/// Wrenches in W at the origins of frames or bodies.
struct FrameWrenches {
  std::vector<Robot::Place> places;
  std::vector<Wrenchd> wrenches;

  FrameWrenches(const Robot& robot, const std::vector<std::string>& frames, const py::object& given) {
    for (const std::string& frame : frames) places.push_back(robot.place(frame));
    wrenches.assign(frames.size(), Wrenchd::zero());
    if (given.is_none()) return;
    const py::array_t<double> array = doubles(given, "wrenches");
    check_finite(array, "wrenches");
    if (array.ndim() != 2 || array.shape(0) != static_cast<py::ssize_t>(frames.size()) || array.shape(1) != 6)
      throw py::value_error("wrenches has shape " + shape_text(shape_of(array)) + ", expected (" +
                            std::to_string(frames.size()) + ", 6): [moment; force] for each of frames");
    const auto at = array.unchecked<2>();
    for (py::ssize_t i = 0; i < array.shape(0); ++i)
      wrenches[static_cast<std::size_t>(i)] = {{at(i, 0), at(i, 1), at(i, 2)}, {at(i, 3), at(i, 4), at(i, 5)}};
  }
  std::vector<lanes::StateWrench> in_lanes(const Robot& robot) const {
    std::vector<lanes::StateWrench> result;
    for (std::size_t i = 0; i < places.size(); ++i) {
      const BodyPlacement& body = robot.model().bodies()[static_cast<std::size_t>(places[i].body)].placement;
      const Vector3d p = body.X_LB * places[i].X_BE.p;
      const Wrenchd& F = wrenches[i];
      result.push_back({body.link,
                        {p[0], p[1], p[2]},
                        {F.angular[0], F.angular[1], F.angular[2], F.linear[0], F.linear[1], F.linear[2]}});
    }
    return result;
  }
  void apply(const Robot& robot, const State& state, Kinematics& kinematics, Forces& forces) const {
    if (places.empty()) return;
    forward_kinematics(robot.model(), state, kinematics);
    forces.external.clear();
    for (std::size_t i = 0; i < places.size(); ++i)
      forces.external.push_back(
          {places[i].body, kinematics.X_WB[static_cast<std::size_t>(places[i].body)] * places[i].X_BE.p, wrenches[i]});
  }
};

/// Zero acceleration of a free base, or nothing.
inline PrescribedMotion held_base(const Robot& robot, bool is_held) {
  PrescribedMotion held;
  if (!is_held || !robot.model().has_free_root(robot.root())) return held;
  const auto n = static_cast<std::size_t>(robot.model().velocities());
  held.prescribed.assign(n, 0), held.vdot.assign(n, 0.0);
  std::fill_n(held.prescribed.begin() + robot.model().bodies()[static_cast<std::size_t>(robot.root())].v, 6, 1);
  return held;
}

}  // namespace grapnel::python
