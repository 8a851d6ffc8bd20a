#include "grapnel/contact/caging.hpp"

#include <algorithm>

#include "grapnel/contact/cage_poses.hpp"

namespace grapnel {
namespace {

// A body with the tree of its poses that can be reached.
struct SearchedBody {
  SearchedBody(const Cage& cage, double resolution, double allowance)
      : cage_(cage), poses(cage_, resolution, allowance), tree(poses, evaluated) {}
  SearchedBody(const SearchedBody&) = delete;
  SearchedBody& operator=(const SearchedBody&) = delete;

  // Grows the tree, with at most this number of evaluated poses => whether it leads out.
  bool escapes(long evaluations) { return tree.grow(evaluations); }

  // Cells, and the tree along their cheapest paths => answer.
  CageAnswer search_cells(long max_cells) {
    evaluated = 0;
    CageAnswer found;
    const long trials = max_cells / 4;
    prove_caged(poses, max_cells, found,
                [&](const auto& goals) { return evaluated < trials && tree.follow(goals, trials - evaluated); });
    found.cells += evaluated;
    return found;
  }

 private:
  const Cage cage_;

 public:
  CagePoses poses;
  long evaluated = 0;
  EscapeTree tree;
};

}  // namespace

// Cage => answer: first a search for a path that leads out, which is quick if there is a wide one; then proofs that
// there is none: by balls inside of the body, and by the whole body.
CageAnswer search_cage(const Cage& cage, const CageSearch& search) {
  using Verdict = CageAnswer::Verdict;
  constexpr long kInnerTree = 2000;  // evaluations that may show that a ball is no proof
  SearchedBody whole(cage, search.resolution, 0);
  const double resolution = whole.poses.resolution(), allowance = whole.poses.allowance();
  CageAnswer answer;
  answer.resolution = resolution, answer.allowance = allowance;
  const bool leaves = whole.escapes(search.max_cells / 10);
  answer.cells = whole.evaluated;
  if (leaves) {
    answer.verdict = Verdict::can_leave;
    return answer;
  }
  std::vector<ContactShape> balls;  // a body of concentric spheres is one itself
  if (whole.poses.rotations().dims > 0) balls = inner_balls(cage.moving);
  const auto share_of = [&](std::size_t rest) { return (search.max_cells - answer.cells) / static_cast<long>(rest); };
  for (std::size_t i = 0; i < balls.size(); ++i) {
    SearchedBody inner({cage.fixed, {balls[i]}, cage.X_FM}, resolution, allowance);
    const bool is_proof = !inner.escapes(std::min(kInnerTree, share_of(10)));
    answer.cells += inner.evaluated;
    if (!is_proof) continue;
    const CageAnswer found = inner.search_cells(share_of(balls.size() + 1 - i));
    answer.cells += found.cells;
    if (found.verdict != Verdict::caged) continue;
    answer.verdict = Verdict::caged;
    return answer;
  }
  const CageAnswer found = whole.search_cells(share_of(1));
  answer.verdict = found.verdict, answer.out_of_cells = found.out_of_cells;
  answer.cells += found.cells;
  return answer;
}

}  // namespace grapnel
