#pragma once

/// @file
/// Stability of x' = A x + B u under u = K x, continuous or sampled with zero-order hold and delay: eigenvalues without
/// those of drift and conserved momenta, and margins of each channel (docs/theory, section 27).

#include <Eigen/Core>
#include <complex>
#include <optional>
#include <string>
#include <vector>

#include "grapnel/linear/linear_model.hpp"
#include "grapnel/simulate/control_setup.hpp"

namespace grapnel {

/// x' = A x + B u and u = K x.
struct LinearLoop {
  Eigen::MatrixXd A, B, K;
  Eigen::MatrixXd error;                     // of the entries of A; empty: none
  std::vector<std::string> states;           // names
  std::optional<ControlTiming> timing = {};  // absent: continuous
  double free_rotation = 0;                  // rate of a base whose rotation no law controls [rad/s]; else 0
  double motion_rate = 0;                    // with which A changes: the fastest rotation of the motion [rad/s]
  std::vector<std::string> doubts = {};      // limits that the loop lacks
  // Of the fastest growth, in its own time constant, of its size; absent: not computed.
  std::optional<double> change = {};
  std::optional<LinearModel::Eigenvalue> growth_at_rest =
      {};  // in the same configuration; absent: none, or not computed
};

/// Linearly independent conserved momenta L x, whose components turn with a body: (L x)' = turning L x. `solved`:
/// states that follow from them, as many as rows. `error`: estimated, of L.
struct ConservedRows {
  Eigen::MatrixXd L, turning;
  std::vector<int> solved;
  Eigen::MatrixXd error = {};
};

/// A loop without the conserved momenta and the positions on which nothing depends.
struct ReducedLoop {
  LinearLoop loop;
  Eigen::MatrixXd map;                                 // the whole state by the reduced one
  std::vector<std::complex<double>> conserved, drift;  // eigenvalues of what was removed
  bool is_steady = false;                              // by (27.6)
  std::string unsteady;                                // (27.6) does not hold; else empty
};
/// `conserved`: absent if nothing is. `positions`: the number of leading states that are positions.
ReducedLoop reduced_loop(LinearLoop loop, const std::optional<ConservedRows>& conserved, int positions);

/// Zero-order hold: x[k+1] = Ad x[k] + now u[k - whole] + previous u[k - whole - 1].
struct HeldInput {
  Eigen::MatrixXd Ad, now, previous;
  int whole = 0;
};
HeldInput hold_inputs(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B, const ControlTiming& timing);

LinearModel::Modes modes_of(const ReducedLoop& reduced);

/// A channel: inputs move as `direction` times the channel's command, which is `gain` times the state.
struct LoopChannel {
  std::string name, unit;
  Eigen::VectorXd direction;
  Eigen::RowVectorXd gain;
};
/// Margins of each channel with the others closed; the sum of direction gain over all channels is the loop's K. The
/// loop must be stable up to drift.
std::vector<LinearModel::Margin> margins_of(const LinearLoop& loop, const std::vector<LoopChannel>& channels);

}  // namespace grapnel
