// Pinocchio on the Gen3: pose, Jacobian and dynamics of the arm's seven joints, jaws locked.
//
//     pip install pin                      # its library and headers; Eigen 3 beside it
//     P=$(python -c 'import cmeel_pth, pathlib; print(pathlib.Path(cmeel_pth.__file__).parent / "cmeel.prefix")')
//     g++ -std=c++17 -O2 -DNDEBUG -w -DBOOST_MPL_LIMIT_LIST_SIZE=30 -DBOOST_MPL_LIMIT_VECTOR_SIZE=30 \
//         -DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS -DBOOST_FUSION_INVOKE_MAX_ARITY=12 \
//         -I $P/include -I /usr/include/eigen3 benches/peers/pinocchio_kernels.cc \
//         -L $P/lib -lpinocchio_default -lpinocchio_parsers -Wl,-rpath,$P/lib -o pinocchio_kernels
//     ./pinocchio_kernels stdlib/robots/gen3_2f85/gen3_2f85.urdf
//
// The least of 31 times 1,000 calls, ns, over 64 random configurations; `cargo bench --bench plan -- motion` is ours.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <string>
#include <vector>

#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/frames.hpp>
#include <pinocchio/algorithm/jacobian.hpp>
#include <pinocchio/algorithm/joint-configuration.hpp>
#include <pinocchio/algorithm/model.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/parsers/urdf.hpp>

namespace pin = pinocchio;
using Clock = std::chrono::steady_clock;

template <typename Work> static void time(const char *name, Work work) {
    double least = 1e30;
    for (int repeat = 0; repeat < 31; ++repeat) {
        const auto begin = Clock::now();
        for (int call = 0; call < 1000; ++call) work(call % 64);
        least = std::min(least, std::chrono::duration<double, std::nano>(Clock::now() - begin).count() / 1000);
    }
    std::printf("%-20s %8.0f ns\n", name, least);
}

int main(int argc, char **argv) {
    if (argc != 2) {
        std::fprintf(stderr, "usage: %s FILE.urdf\n", argv[0]);
        return 2;
    }
    pin::Model whole;
    pin::urdf::buildModel(argv[1], whole);
    // The arm's joints come first on the way to the tip; everything after the seventh is the gripper's.
    std::vector<pin::JointIndex> jaws;
    for (pin::JointIndex joint = 8; joint < static_cast<pin::JointIndex>(whole.njoints); ++joint) jaws.push_back(joint);
    const pin::Model model = pin::buildReducedModel(whole, jaws, pin::neutral(whole));
    pin::Data data(model);
    const pin::FrameIndex tip = model.nframes - 1;
    std::vector<Eigen::VectorXd> q, v, tau;
    std::srand(1);
    for (int k = 0; k < 64; ++k) {
        // Joints without limits are a cosine and a sine here.
        Eigen::VectorXd drawn = pin::neutral(model);
        q.push_back(pin::integrate(model, drawn, 2.0 * Eigen::VectorXd::Random(model.nv)));
        v.push_back(Eigen::VectorXd::Random(model.nv));
        tau.push_back(10.0 * Eigen::VectorXd::Random(model.nv));
    }
    std::printf("%d joints, tip %s\n", model.njoints - 1, model.frames[tip].name.c_str());
    double sum = 0.0;
    time("pose", [&](int k) {
        pin::forwardKinematics(model, data, q[k]);
        pin::updateFramePlacement(model, data, tip);
        sum += data.oMf[tip].translation()[0];
    });
    Eigen::Matrix<double, 6, Eigen::Dynamic> columns(6, model.nv);
    time("pose and Jacobian", [&](int k) {
        pin::computeJointJacobians(model, data, q[k]);
        pin::updateFramePlacement(model, data, tip);
        pin::getFrameJacobian(model, data, tip, pin::LOCAL_WORLD_ALIGNED, columns);
        sum += columns(0, 0);
    });
    time("inverse dynamics", [&](int k) { sum += pin::rnea(model, data, q[k], v[k], v[k])[0]; });
    time("mass matrix", [&](int k) { sum += pin::crba(model, data, q[k], pin::Convention::LOCAL)(0, 0); });
    time("forward dynamics", [&](int k) { sum += pin::aba(model, data, q[k], v[k], tau[k])[0]; });
    // Printed, so that nothing is left out.
    std::fprintf(stderr, "%g\n", sum);
}
