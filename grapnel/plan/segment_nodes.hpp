#pragma once

/// @file
/// The nodes of a path segment, one per SIMD lane: plain data for files compiled with instruction-set flags, and the
/// computations on it. A panel's nodes fill the lanes of every instruction set. The equations are in
/// segment_node_packs.hpp.

#include "grapnel/model/tree.hpp"
#include "grapnel/spatial/spatial_vector.hpp"

namespace grapnel {

inline constexpr int kPanelNodes = 16;
/// Number of partial sums over nodes, grouped by node index modulo kSumParts and added at the end. The result is
/// therefore independent of the number of lanes.
inline constexpr int kSumParts = 8;

/// Offsets of a node's numbers, in the order of PlacedNumbers and of path_segment.hpp.
struct NodeLayout {
  int X_BL, axis, composite, inertia, joint_momentum, k;  // offset of the first link or joint
  int com, mass, H_inverse;
  int u, R, w_B, Phi;  // R row by row, Phi column by column
  int rate;            // of the joints
  int g;               // (6) of floating_base.hpp, per joint
  int g_turned;        // contribution of g_j to the integrand of (3), per joint
  int k_turned;        // contribution of k_j
  int size;
};

/// The servicer, the collocation and the layout.
struct NodeTables {
  const TreeLink<double>* links;
  int link_count, coordinates;
  const int *joint_link, *link_joint;
  int joints, knots;
  NodeLayout layout;
  const double* a;  // a_ij of the collocation at [j kPanelNodes + i]
};

/// One panel of a segment.
struct NodePanel {
  bool floats, turns;  // settings of FloatingBase
  bool driven;         // L is not zero
  Vector3d L;          // angular momentum about the centre of mass, in W
  double h;            // length of the panel [s]
  int first, nodes;    // its first node; number of nodes of all panels
  int storage_index;   // storage index of its first node in SegmentNodes::numbers
  // Joint motion: theta = start + a (final - start) + b final_rate + c start_rate + sum_k coefficient_k N_k.
  const double *start, *start_rate, *final, *final_rate;
  const double* coefficients;
  int coefficient_count;
  const double* basis;   // a, b, c, N_0...: for each, values at all nodes, then rates at all nodes
  const double* weight;  // of all nodes

  // turn(): the quaternion at the panel's begin; its rates and the angular velocities at the nodes.
  double q[4];
  double q_rate[4][kPanelNodes];  // times h
  double w_B[3][kPanelNodes];
  // sensitivities(): Phi at the panel's begin, column-major, its rates, and the integral of (3): three sums in
  // kSumParts parts per unknown.
  double Phi[9];
  double Phi_rate[9][kPanelNodes];
  double* sums;
};

/// Computation in the packs of one instruction set. Results are bitwise independent of the set.
class SegmentNodes {
 public:
  SegmentNodes() = default;
  SegmentNodes(const SegmentNodes&) = delete;
  SegmentNodes& operator=(const SegmentNodes&) = delete;
  virtual ~SegmentNodes();

  /// Allocates storage for this number of nodes, a multiple of kPanelNodes; previous contents are lost.
  virtual void reserve(int nodes) = 0;
  /// Places the links at the nodes.
  virtual void place(NodePanel& panel) = 0;
  /// Solves for the rotation at the nodes by fixed-point iteration, after place(); false if it does not converge.
  virtual bool turn(NodePanel& panel) = 0;
  /// Computes Phi and accumulates the sums, after turn().
  virtual void sensitivities(NodePanel& panel) = 0;

  /// Number `index` (NodeLayout) of node n is at [((n / lanes) size + index) lanes + n % lanes].
  const double* numbers = nullptr;
  int lanes = 1;
};

/// The factory of an instruction set, defined in segment_nodes_set.cpp. `tables` is copied; the data that it points to
/// must outlive the result. The caller deletes the result.
template <class Set>
SegmentNodes* make_segment_nodes_of(const NodeTables& tables);

}  // namespace grapnel
