// The order conditions of the tableau, for every rooted tree (Butcher; HNW I, II.2): Σ b_i Φ_i(tree) = 1/γ(tree).
#include "grapnel/integrate/dormand_prince_853_kernel.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

namespace grapnel {
namespace tableau_test {

using Stages = std::array<double, dop853::kExtendedStages>;

struct Tableau {
  std::array<Stages, dop853::kExtendedStages> a{};

  Tableau() {
    set(2, dop853::kStage2), set(3, dop853::kStage3), set(4, dop853::kStage4), set(5, dop853::kStage5);
    set(6, dop853::kStage6), set(7, dop853::kStage7), set(8, dop853::kStage8), set(9, dop853::kStage9);
    set(10, dop853::kStage10), set(11, dop853::kStage11), set(12, dop853::kStage12), set(13, dop853::kSolution);
    set(14, dop853::kStage14), set(15, dop853::kStage15), set(16, dop853::kStage16);
  }
  template <class Row>
  void set(int stage, const Row& row) {
    a[stage - 1] = weights(row);
  }
  template <class Row>
  static Stages weights(const Row& row) {
    Stages result{};
    for (const dop853::Term& term : row) result[term.stage - 1] += term.weight;
    return result;
  }
};

double dot(const Stages& a, const Stages& b) {
  double sum = 0.0;
  for (int i = 0; i < dop853::kExtendedStages; ++i) sum += a[i] * b[i];
  return sum;
}

struct Tree {
  int order;
  double gamma;
  Stages phi;
};

// All multisets of subtrees (from index `first` on) that complete `partial`, whose order so far is partial.order.
void graft(const Tableau& tableau, const std::vector<Tree>& smaller, std::size_t first, const Tree& partial, int order,
           std::vector<Tree>& trees) {
  if (partial.order == order) {
    trees.push_back(partial);
    trees.back().gamma *= order;
    return;
  }
  for (std::size_t s = first; s < smaller.size() && partial.order + smaller[s].order <= order; ++s) {
    Tree next{partial.order + smaller[s].order, partial.gamma * smaller[s].gamma, partial.phi};
    for (int i = 0; i < dop853::kExtendedStages; ++i) next.phi[i] *= dot(tableau.a[i], smaller[s].phi);
    graft(tableau, smaller, s, next, order, trees);
  }
}

std::vector<Tree> trees_up_to(int largest_order) {
  const Tableau tableau;
  std::vector<Tree> trees;
  Stages ones;
  ones.fill(1.0);
  for (int order = 1; order <= largest_order; ++order) {
    std::vector<Tree> found;
    graft(tableau, trees, 0, {1, 1.0, ones}, order, found);
    trees.insert(trees.end(), found.begin(), found.end());
  }
  return trees;
}

// Largest |Σ b_i Φ_i − θ^order/γ| over the trees up to an order.
double largest_defect(const Stages& b, int order, double theta = 1.0) {
  double largest = 0.0;
  for (const Tree& tree : trees_up_to(order)) {
    largest = std::max(largest, std::abs(dot(b, tree.phi) - std::pow(theta, tree.order) / tree.gamma));
  }
  return largest;
}

TEST(DormandPrinceTableau, ThereAre200TreesUpToOrder8) {
  EXPECT_EQ(trees_up_to(8).size(), 200U);
  EXPECT_EQ(trees_up_to(9).size(), 486U);
}

TEST(DormandPrinceTableau, RowSumsAreTheNodes) {
  const Tableau tableau;
  for (int i = 0; i < dop853::kExtendedStages; ++i) {
    double sum = 0.0;
    for (const double a : tableau.a[i]) sum += a;
    EXPECT_NEAR(sum, dop853::kNodes[i], 2e-14) << "stage " << i + 1;  // measured at most 6.1e-15
  }
}

TEST(DormandPrinceTableau, SolutionHasOrder8AndNotMore) {
  const Stages b = Tableau::weights(dop853::kSolution);
  EXPECT_LT(largest_defect(b, 8), 1e-14);  // measured 2.2e-15
  EXPECT_GT(largest_defect(b, 9), 1e-7);   // measured 2.7e-5
}

TEST(DormandPrinceTableau, SolutionIntegratesPolynomials) {
  for (int k = 1; k <= 8; ++k) {
    double sum = 0.0;
    for (const dop853::Term& term : dop853::kSolution)
      sum += term.weight * std::pow(dop853::kNodes[term.stage - 1], k - 1);
    EXPECT_NEAR(sum, 1.0 / k, 1e-15) << "k = " << k;  // measured at most 4.4e-16
  }
}

TEST(DormandPrinceTableau, EmbeddedFormulasHaveOrder5And3) {
  const Stages b = Tableau::weights(dop853::kSolution);
  Stages b5 = b;
  for (const dop853::Term& term : dop853::kError5) b5[term.stage - 1] -= term.weight;
  EXPECT_LT(largest_defect(b5, 5), 1e-14);  // measured 5e-15
  EXPECT_GT(largest_defect(b5, 6), 1e-6);   // measured 4.5e-4

  const Stages b3 = Tableau::weights(dop853::kThirdOrder);
  EXPECT_LT(largest_defect(b3, 3), 1e-14);  // measured 3.6e-15
  EXPECT_GT(largest_defect(b3, 4), 1e-4);   // measured 0.025
}

// The weights b_i(θ) of the dense output, from the polynomial that the stepper evaluates.
Stages dense_weights(double theta) {
  const Stages b = Tableau::weights(dop853::kSolution);
  const std::array<Stages, 4> d = {Tableau::weights(dop853::kDense4), Tableau::weights(dop853::kDense5),
                                   Tableau::weights(dop853::kDense6), Tableau::weights(dop853::kDense7)};
  Stages weights{};
  const double rest = 1.0 - theta;
  for (int i = 0; i < dop853::kExtendedStages; ++i) {
    const double first = i == 0 ? 1.0 : 0.0;
    const double last = i == 12 ? 1.0 : 0.0;
    const double c2 = first - b[i];
    const double c3 = b[i] - last - c2;
    const double tail = d[0][i] + theta * (d[1][i] + rest * (d[2][i] + theta * d[3][i]));
    weights[i] = theta * (b[i] + rest * (c2 + theta * (c3 + rest * tail)));
  }
  return weights;
}

TEST(DormandPrinceTableau, DenseOutputHasOrder7) {
  for (const double theta : {0.05, 0.25, 0.5, 0.7, 0.95}) {
    EXPECT_LT(largest_defect(dense_weights(theta), 7, theta), 2e-13)
        << "theta = " << theta;                                                              // measured at most 2.2e-15
    EXPECT_GT(largest_defect(dense_weights(theta), 8, theta), 1e-9) << "theta = " << theta;  // measured at least 3.9e-6
  }
}

}  // namespace tableau_test
}  // namespace grapnel
