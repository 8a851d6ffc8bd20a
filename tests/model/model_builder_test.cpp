// Building a model: order, names, offsets, and every error with its message.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "grapnel/model/model.hpp"
#include "support/eigen_values.hpp"
#include "support/random_robot.hpp"

namespace grapnel {
namespace model_builder_test {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

BodyDescription body(const std::string& name, const std::string& parent, JointType type) {
  BodyDescription b;
  b.name = name, b.parent = parent;
  b.joint.name = name + "_joint", b.joint.type = type;
  b.mass = 2, b.inertia = Symmetric3d::diagonal(1, 1.1, 1.2);
  return b;
}
BodyDescription base() { return body("base", "", JointType::free); }
BodyDescription link() { return body("link", "base", JointType::revolute); }

// Errors of a model with a base and one modified link.
template <class Spoil>
std::vector<std::string> faults_of_link(Spoil&& spoil) {
  BodyDescription b = link();
  spoil(b);
  try {
    ModelBuilder().add(base()).add(b).build();
  } catch (const ModelError& error) {
    return error.faults();
  }
  return {};
}

TEST(ModelBuilder, SortsParentsFirstAndNumbersCoordinates) {
  const Model model = ModelBuilder()
                          .add(body("hand", "ball", JointType::prismatic))
                          .add(body("ball", "plate", JointType::spherical))
                          .add(body("target", "", JointType::free))
                          .add(body("plate", "base", JointType::fixed))
                          .add(body("arm", "base", JointType::continuous))
                          .add(base())
                          .add(FrameDescription{"tool", "hand", Posed::identity()})
                          .build();
  std::vector<std::string> names;
  for (const Body& b : model.bodies()) names.push_back(b.description.name);
  EXPECT_THAT(names, ElementsAre("target", "base", "plate", "arm", "ball", "hand"));
  std::vector<int> parents, q, v, roots;
  for (const Body& b : model.bodies())
    parents.push_back(b.parent), q.push_back(b.q), v.push_back(b.v), roots.push_back(b.root);
  EXPECT_THAT(parents, ElementsAre(-1, -1, 1, 1, 2, 4));
  EXPECT_THAT(roots, ElementsAre(0, 1, 1, 1, 1, 1));
  EXPECT_THAT(q, ElementsAre(0, 7, 14, 14, 15, 19));
  EXPECT_THAT(v, ElementsAre(0, 6, 12, 12, 13, 16));
  EXPECT_EQ(model.coordinates(), 20);
  EXPECT_EQ(model.velocities(), 17);
  EXPECT_THAT(model.quaternions(), ElementsAre(3, 10, 15));
  EXPECT_THAT(model.joints(), ElementsAre(3, 5));
  EXPECT_EQ(model.mass(), 12);
  EXPECT_EQ(model.tree().links.size(), 5U) << "the plate is merged into the base";
  EXPECT_EQ(model.bodies()[2].placement.link, model.bodies()[1].placement.link);
  EXPECT_TRUE(model.has_free_root(5));
  EXPECT_EQ(model.body_index("arm"), 3);
  EXPECT_EQ(model.frames()[model.frame_index("tool")].body, 5);
}

TEST(ModelBuilder, KeepsMassInTheTree) {
  testing::Random random(0);
  for (int i = 0; i < 50; ++i) {
    testing::RobotOptions options;
    options.targets = i % 3;
    const Model model = testing::random_model(options, random);
    double mass = 0;
    for (const TreeLink<double>& l : model.tree().links) mass += l.inertia.mass;
    EXPECT_NEAR(mass, model.mass(), 1e-12 * mass);
    for (std::size_t l = 0; l < model.tree().links.size(); ++l)
      EXPECT_LT(model.tree().links[l].parent, static_cast<int>(l));
  }
}

TEST(ModelBuilder, ReattachesABodyOfAnExistingModel) {
  const Model before = ModelBuilder()
                           .add(base())
                           .add(link())
                           .add(body("target", "", JointType::free))
                           .add(FrameDescription{"grasp", "target", Posed::identity()})
                           .build();
  JointDescription weld;
  weld.name = "weld", weld.type = JointType::fixed;
  const Posed X{rotation_about({0, 0, 1}, 0.3), {1, 2, 3}};
  const Model after = ModelBuilder(before).attach("target", "link", X, weld).build();
  EXPECT_EQ(before.velocities(), 13);
  EXPECT_EQ(after.velocities(), 7);
  const Body& target = after.bodies()[after.body_index("target")];
  EXPECT_EQ(target.parent, after.body_index("link"));
  EXPECT_EQ(target.root, after.body_index("base"));
  EXPECT_EQ(after.frames()[after.frame_index("grasp")].body, after.body_index("target"));
  EXPECT_EQ(after.mass(), before.mass());
  EXPECT_THAT([&] { ModelBuilder(before).attach("moon", "link", X, weld); },
              ThrowsMessage<std::out_of_range>(HasSubstr("no body 'moon' to attach")));
}

TEST(ModelBuilder, ReportsUnknownNames) {
  const Model model = ModelBuilder().add(base()).add(link()).build();
  EXPECT_THAT([&] { model.body_index("lnik"); },
              ThrowsMessage<std::out_of_range>(HasSubstr("no body 'lnik' in the model; there are 'base', 'link'")));
  EXPECT_THAT([&] { model.frame_index("tool"); },
              ThrowsMessage<std::out_of_range>(HasSubstr("no frame 'tool' in the model; there are none")));
}

TEST(ModelBuilder, AcceptsAValidLink) {
  EXPECT_THAT(faults_of_link([](BodyDescription&) {}), ElementsAre());
}

TEST(ModelBuilder, RejectsAnEmptyModel) {
  EXPECT_THAT([] { ModelBuilder().build(); }, ThrowsMessage<ModelError>(HasSubstr("a model needs at least one body")));
}

TEST(ModelBuilder, RejectsInvalidMass) {
  for (double mass : {0.0, -1.0, std::nan(""), HUGE_VAL}) {
    EXPECT_THAT(faults_of_link([&](auto& b) { b.mass = mass; }),
                ElementsAre(AllOf(HasSubstr("body 'link': mass"), HasSubstr("must be positive"))));
  }
}

TEST(ModelBuilder, RejectsInvalidInertia) {
  EXPECT_THAT(faults_of_link([](auto& b) { b.inertia = Symmetric3d::diagonal(1, 1, -0.5); }),
              ElementsAre(HasSubstr("body 'link': inertia is not positive definite (principal moments -0.5, 1, 1)")));
  EXPECT_THAT(faults_of_link([](auto& b) { b.inertia = Symmetric3d::zero(); }),
              ElementsAre(HasSubstr("not positive definite")));
  // The diagonal alone would pass.
  EXPECT_THAT(faults_of_link([](auto& b) { b.inertia = {1, 1, 1, 1.5, 0, 0}; }),
              ElementsAre(HasSubstr("not positive definite")));
  EXPECT_THAT(
      faults_of_link([](auto& b) { b.inertia = Symmetric3d::diagonal(1, 1, 2.5); }),
      ElementsAre(HasSubstr("breaks the triangle inequality: principal moment 2.5 is larger than the sum of 1 and 1")));
  EXPECT_THAT(faults_of_link([](auto& b) { b.inertia.xz = std::nan(""); }),
              ElementsAre(HasSubstr("inertia is not finite")));
  // A flat plate is at the limit and accepted, also when rotated.
  const Rotationd R = rotation_about({0.6, 0, 0.8}, 0.7);
  EXPECT_EQ(inertia_fault(Symmetric3d::diagonal(1, 1, 2)), "");
  EXPECT_EQ(inertia_fault(rotate(R, Symmetric3d::diagonal(1, 1, 2))), "");
  EXPECT_NE(inertia_fault(rotate(R, Symmetric3d::diagonal(1, 1, 2.001))), "");
}

TEST(ModelBuilder, RejectsInvalidJoints) {
  EXPECT_THAT(faults_of_link([](auto& b) {
                b.joint.axis = {0, 0, 2};
              }),
              ElementsAre(HasSubstr("joint 'link_joint' of body 'link': axis has length 2, must be a unit vector")));
  EXPECT_THAT(faults_of_link([](auto& b) { b.joint.axis = Vector3d::zero(); }),
              ElementsAre(HasSubstr("axis has length 0")));
  EXPECT_THAT(faults_of_link([](auto& b) { b.joint.axis[1] = std::nan(""); }),
              ElementsAre(HasSubstr("must be a unit vector")));
  EXPECT_THAT(faults_of_link([](auto& b) { b.joint.limits.lower = 1, b.joint.limits.upper = -1; }),
              ElementsAre(HasSubstr("lower limit 1 is above upper limit -1")));
  EXPECT_THAT(faults_of_link([](auto& b) { b.joint.limits.rate = 0; }),
              ElementsAre(HasSubstr("rate limit 0 must be positive")));
  EXPECT_THAT(faults_of_link([](auto& b) { b.joint.limits.effort = -3; }),
              ElementsAre(HasSubstr("effort limit -3 must be positive")));
  EXPECT_THAT(faults_of_link([](auto& b) { b.joint.friction.viscous = -1; }),
              ElementsAre(HasSubstr("friction must not be negative")));
  EXPECT_THAT(faults_of_link([](auto& b) { b.joint.friction.transition_rate = 0; }),
              ElementsAre(HasSubstr("transition rate must be positive")));
  EXPECT_THAT(faults_of_link([](auto& b) { b.joint.rotor_inertia = -1e-4; }),
              ElementsAre(HasSubstr("rotor inertia must not be negative")));
}

TEST(ModelBuilder, RejectsInvalidPoses) {
  EXPECT_THAT(faults_of_link([](auto& b) { b.X_PF.p[0] = HUGE_VAL; }),
              ElementsAre(HasSubstr("body 'link': joint placement is not finite")));
  EXPECT_THAT(
      faults_of_link([](auto& b) { b.X_PF.R(0, 0) = 1.01; }),
      ElementsAre(HasSubstr("body 'link': joint orientation is not a rotation (R^T R differs from 1 by 0.0201)")));
  EXPECT_THAT(faults_of_link([](auto& b) { b.X_PF.R(2, 2) = -1; }), ElementsAre(HasSubstr("not a rotation")))
      << "a reflection";
  EXPECT_THAT(faults_of_link([](auto& b) { b.com[2] = std::nan(""); }),
              ElementsAre(HasSubstr("body 'link': centre of mass is not finite")));
}

TEST(ModelBuilder, RejectsInvalidStructure) {
  EXPECT_THAT(faults_of_link([](auto& b) { b.parent = "bass"; }),
              ElementsAre(HasSubstr("body 'link': unknown parent 'bass'")));
  EXPECT_THAT(faults_of_link([](auto& b) { b.name = "base"; }),
              ::testing::Contains(HasSubstr("body 'base' occurs twice")));
  EXPECT_THAT(faults_of_link([](auto& b) { b.parent = ""; }),
              ElementsAre(HasSubstr("body 'link': a root must be free or fixed to the world")));
  EXPECT_THAT(faults_of_link([](auto& b) { b.joint.type = JointType::free; }),
              ElementsAre(HasSubstr("body 'link': only a root can be free")));
  EXPECT_THAT(
      [] {
        ModelBuilder().add(base()).add(body("a", "b", JointType::fixed)).add(body("b", "a", JointType::fixed)).build();
      },
      ThrowsMessage<ModelError>(
          AllOf(HasSubstr("body 'a': its parents form a cycle"), HasSubstr("body 'b': its parents form a cycle"))));
  EXPECT_THAT(
      [] {
        ModelBuilder()
            .add(base())
            .add(FrameDescription{"e", "nobody", Posed::identity()})
            .add(FrameDescription{"e", "base", Posed::identity()})
            .build();
      },
      ThrowsMessage<ModelError>(
          AllOf(HasSubstr("frame 'e': unknown body 'nobody'"), HasSubstr("frame 'e' occurs twice"))));
}

TEST(ModelBuilder, ListsAllErrors) {
  BodyDescription bad = link(), worse = body("worse", "nowhere", JointType::prismatic);
  bad.mass = -1, bad.joint.axis = {1, 1, 0};
  worse.inertia = Symmetric3d::diagonal(1, 1, 9), worse.joint.limits.effort = 0;
  try {
    ModelBuilder().add(base()).add(bad).add(worse).build();
    FAIL() << "built";
  } catch (const ModelError& error) {
    EXPECT_THAT(error.faults(),
                ElementsAre(HasSubstr("body 'link': mass -1"), HasSubstr("body 'link': axis has length 1.41"),
                            HasSubstr("body 'worse': inertia breaks"), HasSubstr("body 'worse': effort limit 0"),
                            HasSubstr("body 'worse': unknown parent 'nowhere'")));
    for (const std::string& fault : error.faults()) EXPECT_THAT(error.what(), HasSubstr(fault));
  }
}

// Joints that move by modes: in a row, alike, of independent modes; and the model spans the same with orthonormal
// columns.
TEST(ModelBuilder, ChecksModalJoints) {
  const auto chain_of = [](std::vector<std::vector<double>> rates, const char* third_on) {
    ModelBuilder builder;
    builder.add(base());
    const char* names[] = {"a", "b", "c"};
    for (std::size_t i = 0; i < rates.size(); ++i) {
      BodyDescription b = body(names[i], i == 0 ? "base" : i == 1 ? "a" : third_on, JointType::revolute);
      b.joint.modal = ModalJoint{"boom", rates[i]};
      builder.add(b);
    }
    return builder.build();
  };
  const Model model = chain_of({{3, 1}, {4, 1}, {0, 1}}, "b");
  ASSERT_EQ(model.tree().chains.size(), 1u);
  const ModalChain& chain = model.tree().chains[0];
  EXPECT_EQ(chain.modes, 2);
  EXPECT_EQ(chain.velocities, (std::vector<int>{6, 7, 8}));
  EXPECT_NEAR(chain.row(0)[0], 0.6, 1e-15);
  EXPECT_NEAR(chain.row(1)[0], 0.8, 1e-15);
  double product = 0, square = 0;
  for (int j = 0; j < 3; ++j) product += chain.row(j)[0] * chain.row(j)[1], square += chain.row(j)[1] * chain.row(j)[1];
  EXPECT_NEAR(product, 0, 1e-15);
  EXPECT_NEAR(square, 1, 1e-15);
  EXPECT_EQ(model.tree().links[2].member, 1);
  const auto refused = [&](auto rates, const char* third_on, const char* why) {
    EXPECT_THAT([&] { chain_of(rates, third_on); }, ThrowsMessage<ModelError>(HasSubstr(why)));
  };
  using Rates = std::vector<std::vector<double>>;
  refused(Rates{{3, 1}, {4, 1}, {0, 1}}, "a", "each must be on the body of the one before it");
  refused(Rates{{3, 1}, {4}, {0, 1}}, "b", "as many modes as each other");
  refused(Rates{{3, 6}, {4, 8}, {1, 2}}, "b", "must be independent");
  refused(Rates{{1, 2}}, "b", "at most as many as joints");
}

}  // namespace model_builder_test
}  // namespace grapnel
