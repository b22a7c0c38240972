// VAMP on the problems of MotionBenchMaker for the Panda: RRT-Connect and simplification, as it publishes them.
//
//     python benches/peers/vamp_motion.py DATA > problems.txt    # what this reads, and how it is built
//     ./vamp_motion problems.txt 5
//
// A line for each problem: set, number, the least time of so many runs (us) to plan and to simplify, length (rad), iterations.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <memory>
#include <string>

#include <vamp/collision/factory.hh>
#include <vamp/planning/rrtc.hh>
#include <vamp/planning/simplify.hh>
#include <vamp/planning/validate.hh>
#include <vamp/random/halton.hh>
#include <vamp/robots/panda.hh>

using Robot = vamp::robots::Panda;
static constexpr std::size_t rake = vamp::FloatVectorWidth;
using Environment = vamp::collision::Environment<float>;
using Wide = vamp::collision::Environment<vamp::FloatVector<rake>>;
using Planner = vamp::planning::RRTC<Robot, rake, Robot::resolution>;
using Clock = std::chrono::steady_clock;

static double us(Clock::time_point begin) {
    return std::chrono::duration<double, std::micro>(Clock::now() - begin).count();
}

static Robot::Configuration configuration(std::istream &in) {
    Robot::ConfigurationArray q;
    for (auto &x : q) in >> x;
    return Robot::Configuration(q);
}

int main(int argc, char **argv) {
    std::ifstream in(argv[1]);
    const int runs = argc > 2 ? std::stoi(argv[2]) : 1, skipped = argc > 3 ? std::stoi(argv[3]) : 0;
    std::string set;
    int index, n;
    while (in >> set >> index >> n) {
        const auto start = configuration(in), goal = configuration(in);
        Environment environment;
        for (int i = 0; i < n; ++i) {
            std::string form;
            float x, y, z, qx, qy, qz, qw, a, b, c;
            in >> form >> x >> y >> z >> qx >> qy >> qz >> qw >> a >> b >> c;
            const Eigen::Matrix3f axes = Eigen::Quaternionf(qw, qx, qy, qz).toRotationMatrix();
            if (form == "box") {
                const vamp::collision::Cuboid<float> box(x, y, z, axes(0, 0), axes(1, 0), axes(2, 0), axes(0, 1), axes(1, 1),
                                                         axes(2, 1), axes(0, 2), axes(1, 2), axes(2, 2), a, b, c);
                (box.axis_3_z == 1.0F ? environment.z_aligned_cuboids : environment.cuboids).push_back(box);
            } else {  // A capsule of radius a whose axis ends b above and below the middle.
                const Eigen::Vector3f half = b * axes.col(2);
                const auto capsule = vamp::collision::factory::capsule::endpoints::flat(
                    x - half[0], y - half[1], z - half[2], x + half[0], y + half[1], z + half[2], a);
                const bool upright = capsule.xv == 0.0F and capsule.yv == 0.0F;
                (upright ? environment.z_aligned_capsules : environment.capsules).push_back(capsule);
            }
        }
        environment.sort();
        const Wide world(environment);
        vamp::planning::RRTCSettings settings;
        settings.range = 1.0;
        const vamp::planning::SimplifySettings simplify;
        double planned = 1e12, simplified = 1e12;
        float length = -1;
        std::size_t iterations = 0;
        for (int run = 0; run < runs; ++run) {
            auto numbers = std::make_shared<vamp::rng::Halton<Robot>>();
            for (int k = 0; k < skipped; ++k) numbers->next();
            auto begin = Clock::now();
            const auto found = Planner::solve(start, goal, world, settings, numbers);
            const double first = us(begin);
            if (found.path.empty()) continue;
            begin = Clock::now();
            const auto shorter =
                vamp::planning::simplify<Robot, rake, Robot::resolution>(found.path, world, simplify, numbers);
            const double second = us(begin);
            if (first + second < planned + simplified) planned = first, simplified = second;
            length = shorter.path.cost();
            iterations = found.iterations;
        }
        std::printf("%s %d %.2f %.2f %.4f %zu\n", set.c_str(), index, planned, simplified, length, iterations);
    }
}
