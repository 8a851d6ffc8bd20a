/// Sequential quadratic programming on programs whose solutions are known.

#include "grapnel/plan/sequential_quadratic.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <span>
#include <vector>

namespace grapnel::testing {
namespace sequential_quadratic_test {

// f and g_i of two unknowns with gradients; no equality constraints unless given.
struct Value {
  double value = 0;
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
};
using Function = std::function<Value(const Eigen::Vector2d&)>;

class Small : public NonlinearProgram {
 public:
  Function f;
  std::vector<Function> goals, rows;
  std::vector<Function> distances;  // f contains minus their minimum
  bool names_all = true;            // else only rows that were violated once
  int visits = 0;

  bool go_to(const std::vector<double>& y) override {
    ++visits;
    y_ = Eigen::Vector2d(y[0], y[1]);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (rows[i](y_).value > 0 || names_all) known_[i] = true;
    }
    return y_.norm() < 100;
  }
  double value() override { return f(y_).value - (distances.empty() ? 0 : least()); }
  double violation() override {
    double most = -std::numeric_limits<double>::infinity();
    for (const Function& g : rows) most = std::max(most, g(y_).value);
    for (const Function& e : goals) most = std::max(most, std::abs(e(y_).value));
    return most;
  }
  bool has_more() override { return known_ != told_; }
  Linearized linearized() override {
    told_ = known_, level_ = distances.empty() ? 0 : least();
    const Eigen::Index size = distances.empty() ? 2 : 3;
    const auto wide = [&](const Eigen::Vector2d& slope, double of_level) {
      Eigen::RowVectorXd row(size);
      row.head(2) = slope.transpose();
      if (size > 2) row[2] = of_level;
      return row;
    };
    Linearized at;
    at.slope = wide(f(y_).slope, -1).transpose();
    at.error.resize(static_cast<Eigen::Index>(goals.size())), at.J.resize(at.error.size(), size);
    for (Eigen::Index i = 0; i < at.error.size(); ++i) {
      const Value e = goals[static_cast<std::size_t>(i)](y_);
      at.error[i] = e.value, at.J.row(i) = wide(e.slope, 0);
    }
    for (long i = 0; i < static_cast<long>(rows.size() + distances.size()); ++i) {
      if (i >= static_cast<long>(rows.size()) || known_[static_cast<std::size_t>(i)]) at.rows.push_back(i);
    }
    at.violated.resize(static_cast<Eigen::Index>(at.rows.size())), at.A.resize(at.violated.size(), size);
    for (Eigen::Index i = 0; i < at.violated.size(); ++i) {
      const long number = at.rows[static_cast<std::size_t>(i)];
      const Value g = row(number);
      at.violated[i] = g.value, at.A.row(i) = wide(g.slope, number < static_cast<long>(rows.size()) ? 0 : 1);
    }
    return at;
  }
  void look(std::span<const long> numbers, Eigen::VectorXd& error, Eigen::VectorXd& violated) override {
    error.resize(static_cast<Eigen::Index>(goals.size()));
    for (Eigen::Index i = 0; i < error.size(); ++i) error[i] = goals[static_cast<std::size_t>(i)](y_).value;
    violated.resize(static_cast<Eigen::Index>(numbers.size()));
    for (Eigen::Index i = 0; i < violated.size(); ++i) violated[i] = row(numbers[static_cast<std::size_t>(i)]).value;
  }
  Eigen::MatrixXd curvature() override { return Eigen::MatrixXd::Identity(2, 2); }

  // Minimizes from y; returns the number of steps.
  int solve(std::vector<double>& y, const QuadraticSearch& search = {}, const std::vector<int>& free = {0, 1}) {
    known_.assign(rows.size(), names_all);
    go_to(y);
    Eigen::MatrixXd B;
    const int steps = minimize(*this, free, search, y, B);
    EXPECT_EQ(y_[0], y[0]);
    EXPECT_EQ(y_[1], y[1]);
    return steps;
  }

 private:
  double least() const {
    double d = std::numeric_limits<double>::infinity();
    for (const Function& each : distances) d = std::min(d, each(y_).value);
    return d;
  }
  // A row of `rows`, or z - d_i.
  Value row(long number) const {
    const auto i = static_cast<std::size_t>(number);
    if (i < rows.size()) return rows[i](y_);
    const Value d = distances[i - rows.size()](y_);
    return {level_ - d.value, -d.slope};
  }

  Eigen::Vector2d y_ = Eigen::Vector2d::Zero();
  double level_ = 0;
  std::vector<bool> known_, told_;
};

Value rosenbrock(const Eigen::Vector2d& y) {
  const double a = 1 - y[0], b = y[1] - y[0] * y[0];
  return {a * a + 100 * b * b, {-2 * a - 400 * y[0] * b, 200 * b}};
}

Function linear(double constant, double per_x, double per_y) {
  return [=](const Eigen::Vector2d& y) { return Value{constant + per_x * y[0] + per_y * y[1], {per_x, per_y}}; };
}

Value outside_unit_circle(const Eigen::Vector2d& y) { return {y.squaredNorm() - 1, 2 * y}; }

Function distance_from(double x0, double y0) {
  return [=](const Eigen::Vector2d& y) {
    const Eigen::Vector2d away = y - Eigen::Vector2d(x0, y0);
    return Value{away.norm(), away / away.norm()};
  };
}

TEST(SequentialQuadratic, FollowsACurvedValley) {
  Small program;
  program.f = rosenbrock;
  std::vector<double> y = {-1.2, 1};
  const int steps = program.solve(y);
  EXPECT_NEAR(y[0], 1, 1e-4);
  EXPECT_NEAR(y[1], 1, 2e-4);
  EXPECT_LE(steps, 80);  // measured 48
}

// Rosenbrock's valley within the unit circle: known to end at (0.7864, 0.6177).
TEST(SequentialQuadratic, StaysWithinACurvedConstraint) {
  Small program;
  program.f = rosenbrock;
  program.rows = {outside_unit_circle};
  std::vector<double> y = {-1.2, 1};  // violated
  program.solve(y);
  EXPECT_NEAR(y[0], 0.786415, 1e-5);
  EXPECT_NEAR(y[1], 0.617698, 1e-5);
  EXPECT_LE(program.violation(), 5e-7);
}

TEST(SequentialQuadratic, SatisfiesDependentGoals) {
  Small program;
  program.f = linear(0, 1, 2);  // minimum on the circle at -(1, 2)/sqrt 5
  const Function twice = [](const Eigen::Vector2d& y) {
    const Value one = outside_unit_circle(y);
    return Value{2 * one.value, 2 * one.slope};
  };
  program.goals = {outside_unit_circle, twice};
  std::vector<double> y = {0.6, 0.8};
  program.solve(y);
  EXPECT_NEAR(y[0], -1 / std::sqrt(5), 1e-6);
  EXPECT_NEAR(y[1], -2 / std::sqrt(5), 1e-6);
}

TEST(SequentialQuadratic, AddsRowsDuringTheSearch) {
  Small program;
  program.f = linear(0, -1, -1);
  // A disc, described by its tangents; a tangent is unknown until it is violated.
  constexpr int kTangents = 40;
  for (int i = 0; i < kTangents; ++i) {
    const double angle = 0.3 + 2 * 3.14159265358979 * i / kTangents;
    program.rows.push_back(linear(-1, std::cos(angle), std::sin(angle)));
  }
  program.names_all = false;
  std::vector<double> y = {0, 0};
  program.solve(y);
  EXPECT_LE(program.violation(), 5e-7);
  // Between the tangents closest to the direction of (1, 1), at a corner of the polygon.
  const double step = 2 * 3.14159265358979 / kTangents, corner = 1 / std::cos(0.5 * step);
  EXPECT_NEAR(std::hypot(y[0], y[1]), corner, 1e-6);
  EXPECT_LE(std::abs(std::atan2(y[1], y[0]) - 0.25 * 3.14159265358979), 0.5 * step);
}

// The point in a triangle farthest from its corners: the circumcentre.
TEST(SequentialQuadratic, MaximizesTheMinimumDistance) {
  Small program;
  program.f = linear(0, 0, 0);
  program.distances = {distance_from(0, 0), distance_from(4, 0), distance_from(1, 3)};
  program.rows = {linear(0, 0, -1), linear(0, -3, 1), linear(-12, 3, 3)};
  std::vector<double> y = {1, 0.4};
  QuadraticSearch search;
  search.settled = 1e-12;
  program.solve(y, search);
  EXPECT_NEAR(y[0], 2, 1e-5);
  EXPECT_NEAR(y[1], 1, 1e-5);
}

TEST(SequentialQuadratic, EndsEarlyForInfeasibleRows) {
  Small program;
  program.f = rosenbrock;
  program.rows = {outside_unit_circle, linear(3, -1, 0)};  // x >= 3 within the circle
  std::vector<double> y = {0.5, 0.5};
  const int steps = program.solve(y);
  EXPECT_LE(steps, 40);  // measured 11
  EXPECT_GT(program.violation(), 1);
}

TEST(SequentialQuadratic, KeepsFixedUnknowns) {
  Small program;
  program.f = rosenbrock;
  std::vector<double> y = {0.5, 2};
  program.solve(y, {}, {1});
  EXPECT_EQ(y[0], 0.5);
  EXPECT_NEAR(y[1], 0.25, 1e-6);
  std::vector<double> stays = y;
  EXPECT_EQ(program.solve(stays, {}, {}), 0);
  EXPECT_EQ(stays, y);
}

}  // namespace sequential_quadratic_test
}  // namespace grapnel::testing
