// SPDX-License-Identifier: Apache-2.0
// tendon-bench-bullet: the pressed block B1 as a deformable body of Bullet, with the tetrahedra of clients/softbody and
// the same patch; see tests/tools/lab/ACCURACY.md. Only built if Bullet is installed (Debian: libbullet-dev).
#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletSoftBody/btDeformableBodySolver.h>
#include <BulletSoftBody/btDeformableLinearElasticityForce.h>
#include <BulletSoftBody/btDeformableMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btDeformableNeoHookeanForce.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>

#include <cstdio>
#include <ctime>
#include <memory>

#include "clients/softbody/fem/material.h"
#include "clients/softbody/fem/patch.h"
#include "tests/clients/softbody/pressed_block.h"
#include "tests/support/plain_usage.h"

namespace tendon::softbody {
namespace {

constexpr btScalar kStep = 0.01F;     // s
constexpr int kSteps = 400;           // the block is then at rest
constexpr btScalar kDamping = 0.05F;  // Pa·s, for both moduli
constexpr btScalar kMass = 0.5F;      // kg

class Press final : public btDeformableLagrangianForce {
 public:
  Press(const Patch& patch, double newtons) : patch_(patch), newtons_(newtons) {}

  void addScaledForces(btScalar scale, TVStack& force) override {
    for (std::size_t i = 0; i < patch_.nodes.size(); ++i) {
      const btSoftBody::Node& node = m_softBodies[0]->m_nodes[patch_.nodes[i]];
      force[node.index][2] -= scale * static_cast<btScalar>(newtons_ * patch_.weights[static_cast<Eigen::Index>(i)]);
    }
  }
  void addScaledExplicitForce(btScalar scale, TVStack& force) override { addScaledForces(scale, force); }
  void addScaledDampingForceDifferential(btScalar, const TVStack&, TVStack&) override {}
  void buildDampingForceDifferentialDiagonal(btScalar, TVStack&) override {}
  void addScaledElasticForceDifferential(btScalar, const TVStack&, TVStack&) override {}
  void addScaledDampingForce(btScalar, TVStack&) override {}
  btDeformableLagrangianForceType getForceType() override { return BT_GRAVITY_FORCE; }

 private:
  const Patch& patch_;
  double newtons_;
};

/// Bullet implements the neo-Hookean law of Smith, de Goes and Kim, "Stable Neo-Hookean Flesh Simulation", ACM TOG
/// 2018. Its parameters are 4/3 µ and λ + 5/6 µ (section 3.4), a conversion that Bullet's setYoungsModulus() omits.
std::unique_ptr<btDeformableLagrangianForce> force_of(Law law, const Material& material) {
  const auto mu = static_cast<btScalar>(material.mu());
  const auto lambda = static_cast<btScalar>(material.lambda());
  if (law == Law::kLinear) return std::make_unique<btDeformableLinearElasticityForce>(mu, lambda, kDamping, kDamping);
  return std::make_unique<btDeformableNeoHookeanForce>(4 * mu / 3, lambda + 5 * mu / 6, kDamping);
}

double processor_ms() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

void press(Law law, int n, double newtons) {
  const Material material{.young = 1e4, .poisson = 0.45};
  const Mesh mesh = block(Shape::kTet4, Vec3(0.1, 0.1, 0.05), {n, n, n / 2});
  const TouchSurface top(mesh, Vec3::UnitZ(), testing::kB1PatchRadius);
  const Patch patch = *top.patch(Vec2::Zero());

  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btDeformableBodySolver solver;
  btDeformableMultiBodyConstraintSolver constraints;
  constraints.setDeformableSolver(&solver);
  btDeformableMultiBodyDynamicsWorld world(&dispatcher, &broadphase, &constraints, &configuration, &solver);
  world.setGravity(btVector3(0, 0, 0));
  world.getWorldInfo().m_gravity.setZero();
  world.setImplicit(true);
  world.setUseProjection(true);

  btAlignedObjectArray<btVector3> nodes;
  for (const Vec3& node : mesh.nodes) {
    nodes.push_back(
        btVector3(static_cast<btScalar>(node.x()), static_cast<btScalar>(node.y()), static_cast<btScalar>(node.z())));
  }
  btSoftBody body(&world.getWorldInfo(), nodes.size(), &nodes[0], nullptr);
  for (int e = 0; e < mesh.element_count(); ++e) {
    const auto tetrahedron = mesh.element(e);
    body.appendTetra(tetrahedron[0], tetrahedron[1], tetrahedron[2], tetrahedron[3]);
  }
  body.m_tetraScratches.resizeNoInitialize(body.m_tetras.size());  // as in Bullet's mesh readers
  body.m_tetraScratchesTn.resizeNoInitialize(body.m_tetras.size());
  body.initializeDmInverse();
  body.setTotalMass(kMass);
  for (int i = 0; i < nodes.size(); ++i) {
    if (nodes[i].z() < 1e-9F) body.setMass(i, 0);
  }
  body.m_cfg.kDP = 0;
  body.m_cfg.collisions = 0;
  body.m_sleepingThreshold = 0;
  body.setActivationState(DISABLE_DEACTIVATION);  // Bullet must not deactivate it
  world.addSoftBody(&body);
  const auto elastic = force_of(law, material);
  Press load(patch, newtons);
  world.addForce(&body, elastic.get());
  world.addForce(&body, &load);

  const double start = processor_ms();
  for (int i = 0; i < kSteps; ++i) world.stepSimulation(kStep, 0);
  const double took = (processor_ms() - start) / kSteps;
  double depth = 0;
  for (std::size_t i = 0; i < patch.nodes.size(); ++i) {
    const int node = patch.nodes[i];
    depth += patch.weights[static_cast<Eigen::Index>(i)] * (nodes[node].z() - body.m_nodes[node].m_x.z());
  }
  world.removeSoftBody(&body);
  std::printf("%-11s n = %-2d  %.1f N  %7.1f N/m  %6.2f ms of processor time a step of %g ms\n",
              law == Law::kLinear ? "linear" : "neo-hookean", n, newtons, newtons / depth, took,
              1e3 * static_cast<double>(kStep));
}

}  // namespace
}  // namespace tendon::softbody

int main(int argc, char** argv) {
  using namespace tendon::softbody;
  const tendon::PlainUsage usage{.help =
                                     "Usage: tendon-bench-bullet\n\n"
                                     "Presses the block B1 as a deformable body of Bullet.\n\n"
                                     "Example: tendon-bench-bullet\n"
                                     "Exit: 0 success; 2 wrong usage.\n"};
  if (const auto code = tendon::answer(usage, argc, argv)) return *code;
  for (const Law law : {Law::kLinear, Law::kNeoHookean}) {
    for (const int n : {4, 6, 8, 12}) {
      for (const double newtons : {0.3, 1.0}) press(law, n, newtons);
    }
  }
}
