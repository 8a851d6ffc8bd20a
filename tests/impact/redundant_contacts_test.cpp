// Contacts that share in many ways what sticking takes: friction at rest, bodies that are wedged, and what is not
// followed for ever.
#include <gtest/gtest.h>

#include <cmath>

#include "grapnel/impact/contact_path.hpp"
#include "grapnel/impact/friction_at_rest.hpp"
#include "impact/contact_case.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace redundant_contacts_test {

// Friction of `points` points at rest whose bodies have three freedoms. Half of the cases can just all stick, since
// some forces use all of the cones except for a fraction of 1e-4.
struct RestCase {
  Eigen::MatrixXd A;
  Eigen::VectorXd b, radius;
};
RestCase random_rest(int index, int points) {
  Random random(7000 + 10 * index + points);
  const std::vector<double> entries = random.values(6 * points, 1), along = random.values(3, 1);
  const Eigen::MatrixXd J = Eigen::Map<const Eigen::MatrixXd>(entries.data(), 2 * points, 3);
  RestCase c{J * J.transpose(), J * Eigen::Map<const Eigen::Vector3d>(along.data()), Eigen::VectorXd(points)};
  for (int i = 0; i < points; ++i) c.radius[i] = std::pow(10, random.uniform(-4, 0));
  if (index % 2 == 1) return c;
  Eigen::VectorXd l(2 * points);
  for (int i = 0; i < points; ++i) {
    // Against the same motion everywhere: no other forces hold more.
    const Eigen::Vector2d slip = c.b.segment<2>(2 * i);
    l.segment<2>(2 * i) = -(1 - 1e-4) * c.radius[i] * slip.normalized();
  }
  c.b = -c.A * l;
  return c;
}

// By how much Coulomb's law is missed, over what drives the points.
double violates_law(const RestCase& c, const Eigen::VectorXd& l) {
  const Eigen::VectorXd rate = c.A * l + c.b;
  double most = 0;
  for (Eigen::Index i = 0; i < c.radius.size(); ++i) {
    const Eigen::Vector2d own = l.segment<2>(2 * i) / c.radius[i], r = rate.segment<2>(2 * i);
    EXPECT_LT(own.norm(), 1 + 1e-12);
    const double against = own.norm() > 1 - 1e-11 ? std::max(0.0, -r.dot(own)) : 0;
    most = std::max(most, (r + against * own).norm());
  }
  return most / c.b.norm();
}

TEST(RedundantFriction, ObeysCoulombsLaw) {
  Worst any("Coulomb's law, any forces"), middle("those in the middle"), said("of what they say themselves");
  int crawled = 0;
  for (int i = 0; i < 200; ++i) {
    SCOPED_TRACE(seed_note(i));
    const RestCase c = random_rest(i, 2 + i % 4);
    const FrictionForces forces = friction_at_rest(c.A, c.b, c.radius);
    crawled += forces.crawled;
    EXPECT_LT(any.note(violates_law(c, forces.force), i), 1e-11);
    const FrictionForces central = friction_at_rest(c.A, c.b, c.radius, {}, FrictionChoice::middle);
    EXPECT_LT(middle.note(violates_law(c, central.force), i), 1e-11);
    EXPECT_LT(said.note(central.missed, i), 1e-11);
    // The rate is the same whatever the forces.
    EXPECT_LT((central.rate - forces.rate).norm(), 1e-10 * c.b.norm());
  }
  EXPECT_GT(crawled, 20);
}

// Steps are extrapolated: forces in the middle must be as smooth as what drives them.
TEST(RedundantFriction, ForcesInTheMiddleAreSmooth) {
  Worst bent("second difference over the square of the change");
  for (int i = 0; i < 40; ++i) {
    SCOPED_TRACE(seed_note(i));
    RestCase c = random_rest(2 * i, 4);
    c.b *= 0.6;
    c.radius.setConstant(c.radius.maxCoeff());
    const Eigen::VectorXd along = c.A * Eigen::VectorXd::Ones(8) / c.A.norm() * c.b.norm();
    const double change = 1e-3;
    const auto forces = [&](double step) {
      return friction_at_rest(c.A, c.b + step * along, c.radius, {}, FrictionChoice::middle).force;
    };
    const Eigen::VectorXd here = forces(0);
    const double second = (forces(change) - 2 * here + forces(-change)).norm() / here.norm();
    EXPECT_LT(bent.note(second / (change * change), i), 100);
  }
}

// A point of mass one that is thrown down into a groove whose sides lean by `lean` from upright.
ContactPathProblem groove(double lean, double friction, RestitutionHypothesis hypothesis, double across = 0.02) {
  Eigen::MatrixXd J(6, 3);
  const double c = std::cos(lean), s = std::sin(lean);
  J << c, 0, s, -s, 0, c, 0, 1, 0, -c, 0, s, s, 0, c, 0, 1, 0;
  ContactPathProblem p;
  p.W = J * J.transpose();
  p.u = J * Eigen::Vector3d(across, 0.1, -1);
  p.hypothesis = hypothesis, p.rounding = 1e-16;
  p.contacts = {{0.5, friction, 1}, {0.5, friction, 1}};
  return p;
}

Eigen::VectorXd velocity_after(const ContactPathProblem& p, const ContactPath& path) {
  return p.u + p.W * path.impulse;
}

// Friction that is stronger than the sides are steep holds the point: the springs stay pressed, and the path ends.
TEST(RedundantContacts, WedgedBodiesComeToRest) {
  for (const double friction : {0.3, 0.6}) {
    const ContactPathProblem p = groove(0.1, friction, RestitutionHypothesis::stronge);
    for (const auto set : lanes::supported_instruction_sets()) {
      const ContactPath path = follow_contacts(std::span(&p, 1), set)[0];
      EXPECT_EQ(path.failure, "");
      EXPECT_LT(path.steps, 2000);
      EXPECT_LT(velocity_after(p, path).norm(), 1e-10);
      double work = 0;
      for (int i = 0; i < 2; ++i) {
        EXPECT_GT(path.impulse[3 * i], 0);
        EXPECT_LE(path.impulse.segment<2>(3 * i + 1).norm(), friction * path.impulse[3 * i] * (1 + 1e-10));
        work += path.normal_work[static_cast<std::size_t>(i)] + path.friction_work[static_cast<std::size_t>(i)];
      }
      EXPECT_NEAR(work, -0.5 * (0.02 * 0.02 + 0.1 * 0.1 + 1), 1e-11);  // all there was
    }
  }
  // Less friction lets it go.
  const ContactPathProblem p = groove(0.6, 0.1, RestitutionHypothesis::stronge);
  const ContactPath path = follow_contacts(p);
  EXPECT_EQ(path.failure, "");
  EXPECT_GT(velocity_after(p, path)[0], 0.1);
}

// Newton's hypothesis demands that they part all the same.
TEST(RedundantContacts, WedgedBodiesThatMustSeparateFail) {
  const ContactPath path = follow_contacts(groove(0.1, 0.6, RestitutionHypothesis::newton, 0));
  EXPECT_EQ(path.failure, "bodies are wedged at rest, and the forces that separate them grow without bound");
  EXPECT_LT(path.steps, 2000);
}

// Many contacts of bodies with three freedoms: every path ends, or reports its failure.
TEST(RedundantContacts, PathsEndOrReportFailure) {
  int ended = 0, crawled = 0;
  for (int i = 0; i < 24; ++i) {
    SCOPED_TRACE(seed_note(i));
    const int contacts = 3 + i % 3, rows = 3 * contacts;
    Random random(900 + i);
    const std::vector<double> entries = random.values(3 * rows, 1), before = random.values(3, 1);
    const Eigen::Map<const Eigen::MatrixXd> J(entries.data(), rows, 3);
    ContactPathProblem p;
    p.W = J * J.transpose();
    p.u = J * Eigen::Map<const Eigen::VectorXd>(before.data(), 3);
    if (p.u[0] > 0) p.u = -p.u;
    p.rounding = 1e-16, p.most_steps = 5000;
    for (int k = 0; k < contacts; ++k) p.contacts.push_back({random.uniform(0, 1), random.uniform(0, 1), 1});
    const ContactPath path = follow_contacts(p);
    if (path.failure.empty()) {
      ++ended;
      // Nothing is left that approaches.
      const Eigen::VectorXd after = velocity_after(p, path);
      for (int k = 0; k < contacts; ++k) EXPECT_GT(after[3 * k], -1e-8 * p.u.norm());
    } else {
      crawled += path.failure.find("interior-point method") != std::string::npos;
      std::printf("[ measured ] case %d: %s\n", i, path.failure.c_str());
    }
  }
  EXPECT_GT(ended, 24 * 8 / 10);
  std::printf("[ measured ] ended %d, crawled %d\n", ended, crawled);
}

TEST(RedundantContacts, OthersSkippedIfFirstFails) {
  std::vector<ContactPathProblem> problems(5, groove(0.6, 0.3, RestitutionHypothesis::poisson));
  const auto ends = [&](OtherPaths others, std::optional<lanes::InstructionSet> set) {
    std::vector<std::string> failures;
    for (const ContactPath& path : follow_contacts(problems, set, others)) failures.push_back(path.failure);
    return failures;
  };
  const std::string none, out = "contacts did not part within 3 steps of the inner time",
                          left = "not followed to its end: the first path failed";
  using Failures = std::vector<std::string>;
  for (const auto set : lanes::supported_instruction_sets()) {
    problems[0].most_steps = 100000;
    EXPECT_EQ(ends(OtherPaths::if_first_ends, set), Failures(5, none));
    problems[0].most_steps = 3;
    EXPECT_EQ(ends(OtherPaths::always, set), (Failures{out, none, none, none, none}));
    EXPECT_EQ(ends(OtherPaths::if_first_ends, set), (Failures{out, left, left, left, left}));
  }
}

}  // namespace redundant_contacts_test
}  // namespace grapnel::testing
