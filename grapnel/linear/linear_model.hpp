#pragma once

/// @file
/// The linear model of a scenario at a time, with the stability of its controllers; docs/formats/linear-model.md is
/// the contract of its files.

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "grapnel/describe/type.hpp"
#include "grapnel/result/actuation_result.hpp"

namespace grapnel {

/// The types of a linear model, complete before it: it has optional members of them.
struct LinearModelParts {
  /// A matrix as a list of rows.
  using Matrix = std::vector<std::vector<double>>;

  struct Variable {
    std::string name, unit;
    std::optional<double> value;  // at the operating point; absent: the operating point is the origin
  };
  /// x[k+1] = Ad x[k] + Bd u[k - n] + Bd_previous u[k - n - 1], n the whole periods in the delay.
  struct Sampled {
    double period = 0, delay = 0;  // [s]
    std::size_t whole_periods = 0;
    Matrix Ad, Bd, Bd_previous;
  };
  enum class Kind { decays, grows, oscillates, tumbles, drift, conserved };
  struct Eigenvalue {
    Kind kind = Kind::decays;
    double real = 0, imaginary = 0;             // continuous [1/s]; of a sampled loop the equivalent ln(z) / period
    std::optional<double> z_real, z_imaginary;  // of a sampled loop
    double frequency = 0;                       // magnitude [rad/s]
    std::optional<double> damping_ratio;        // absent: zero eigenvalue
    std::string state;                          // that participates most
  };
  using Stability = LinearStability;
  struct Modes {
    Stability verdict = Stability::stable;
    std::string reason;
    std::vector<Eigenvalue> eigenvalues;  // the least stable first; then drift and conserved
  };
  using Margin = LoopMargin;
  struct ClosedLoop {
    std::vector<std::string> laws;
    Modes stability;
    bool sampled = false;
    std::vector<std::string> states;  // of K: without joints that move as prescribed
    Matrix K;                         // u = K x
    std::vector<Margin> margins;
    std::string margins_absent;  // why there are none; empty: there are
  };
};

struct LinearModel : LinearModelParts {
  std::string version, scenario, sha256, phase;
  double time = 0;
  std::vector<Variable> states, inputs, outputs;
  Matrix A, B, C, D;
  double difference_error = 0;  // estimated, relative to the largest entry of A
  std::optional<Sampled> sampled;
  Modes open_loop;
  std::optional<ClosedLoop> closed_loop;
  std::string closed_loop_absent;  // why there is none; empty: there is
  std::vector<std::string> notes;  // what the model does not contain, and how nonlinear parts are linearized
  std::vector<std::string> warnings;
};
template <>
const Type& type_of<LinearModel>();

LinearModel::Matrix rows_of(const Eigen::MatrixXd& matrix);
/// `columns`: of a matrix without rows.
Eigen::MatrixXd matrix_of(const LinearModel::Matrix& rows, std::size_t columns = 0);

/// K of the closed loop by all states of A: zero for those that its own states lack, since they move as prescribed.
LinearModel::Matrix gain_of_all_states(const LinearModel& model);

std::string linear_model_json(const LinearModel& model);
/// The tables of the terminal.
std::string linear_model_text(const LinearModel& model);
/// A MAT file of version 5 with the variables A, B, C, D, their names and units, the operating point, Ad, Bd,
/// Bd_previous of a sampled model and K of a closed loop. @throws CannotWrite.
void write_linear_model_mat(const LinearModel& model, const std::filesystem::path& path);

}  // namespace grapnel
