// Plans the same problems with VAMP and prints the same figures, for runs beside `main.rs`.
//
//   gunzip -k ../data/*.problems.gz
//   g++ -std=c++17 -O3 -march=native -mavx2 -fno-math-errno -fno-signed-zeros -fno-trapping-math -fno-rounding-math
//       -ffp-contract=fast -fassociative-math -Ivamp/src/impl -I/usr/include/eigen3 -Inigh/src -Ipdqsort
//       -ISIMDxorshift/include vamp.cc -o vamp && ./vamp ../data REPEATS
//
// (VAMP's own flags; its dependencies are those its CMake files name.)

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include <vamp/collision/factory.hh>
#include <vamp/planning/rrtc.hh>
#include <vamp/planning/simplify.hh>
#include <vamp/planning/validate.hh>
#include <vamp/random/halton.hh>
#include <vamp/robots/panda.hh>
#include <vamp/robots/ur5.hh>

using World = vamp::collision::Environment<float>;
static constexpr std::size_t rake = vamp::FloatVectorWidth;
using WorldLanes = vamp::collision::Environment<vamp::FloatVector<rake>>;

struct Problem
{
    std::string scene;
    std::vector<float> start, goal;
    World world;
};

static std::array<double, 3> turned(const double *q, double x, double y, double z)
{
    const double a = q[0], b = q[1], c = q[2], w = q[3];
    return {
        (1 - 2 * (b * b + c * c)) * x + 2 * (a * b - w * c) * y + 2 * (a * c + w * b) * z,
        2 * (a * b + w * c) * x + (1 - 2 * (a * a + c * c)) * y + 2 * (b * c - w * a) * z,
        2 * (a * c - w * b) * x + 2 * (b * c + w * a) * y + (1 - 2 * (a * a + b * b)) * z};
}

static void add(Problem &problem, const std::string &kind, const std::array<double, 10> &n)
{
    const auto x = turned(&n[3], 1, 0, 0), y = turned(&n[3], 0, 1, 0), z = turned(&n[3], 0, 0, 1);
    const auto box = [&](double hx, double hy, double hz)
    {
        const vamp::collision::Cuboid<float> cuboid(
            n[0], n[1], n[2], x[0], x[1], x[2], y[0], y[1], y[2], z[0], z[1], z[2], hx, hy, hz);
        (cuboid.axis_3_z == 1.F ? problem.world.z_aligned_cuboids : problem.world.cuboids).push_back(cuboid);
    };
    if (kind == "box")
    {
        box(n[7] / 2, n[8] / 2, n[9] / 2);
    }
    else if (problem.scene == "box")
    {
        box(n[7], n[7], n[8] / 2);
    }
    else
    {
        const double h = n[8] / 2;
        const auto capsule = vamp::collision::factory::capsule::endpoints::flat(
            n[0] + z[0] * h, n[1] + z[1] * h, n[2] + z[2] * h, n[0] - z[0] * h, n[1] - z[1] * h, n[2] - z[2] * h, n[7]);
        const bool upright = capsule.xv == 0 and capsule.yv == 0;
        (upright ? problem.world.z_aligned_capsules : problem.world.capsules).push_back(capsule);
    }
}

static std::vector<Problem> read(const std::string &path)
{
    std::vector<Problem> problems;
    std::ifstream file(path);
    for (std::string line; std::getline(file, line);)
    {
        std::istringstream words(line);
        std::string kind, name;
        words >> kind;
        if (kind == "problem")
        {
            problems.emplace_back();
            words >> problems.back().scene;
        }
        else if (kind == "start" or kind == "goal")
        {
            auto &values = kind == "start" ? problems.back().start : problems.back().goal;
            for (float x; words >> x;)
            {
                values.push_back(x);
            }
        }
        else
        {
            std::array<double, 10> n{};
            words >> name;
            for (auto &x : n)
            {
                words >> x;
            }
            add(problems.back(), kind, n);
        }
    }
    return problems;
}

static void print(const char *what, std::vector<double> values)
{
    std::sort(values.begin(), values.end());
    double sum = 0;
    for (const auto x : values)
    {
        sum += x;
    }
    const auto at = [&](double share)
    {
        const double k = share * (values.size() - 1);
        const auto i = static_cast<std::size_t>(k);
        return values[i] + (k - i) * (values[std::min(i + 1, values.size() - 1)] - values[i]);
    };
    std::printf("  %-12s mean %9.3f median %9.3f 95 %% %9.3f max %9.3f\n", what, sum / values.size(), at(0.5), at(0.95),
                values.back());
}

template <class Robot>
static void measure(const std::string &path, float range, int repeats)
{
    using namespace vamp::planning;
    auto problems = read(path);
    std::size_t valid = 0;
    std::vector<double> plan, simplify, total, cost;
    for (auto &problem : problems)
    {
        problem.world.sort();
        const WorldLanes world(problem.world);
        alignas(64) std::array<float, 16> s{}, g{};
        std::copy(problem.start.begin(), problem.start.end(), s.begin());
        std::copy(problem.goal.begin(), problem.goal.end(), g.begin());
        const typename Robot::Configuration start(s.data()), goal(g.data());
        if (not validate_motion<Robot, rake, 1>(start, start, world) or
            not validate_motion<Robot, rake, 1>(goal, goal, world))
        {
            continue;
        }
        valid++;
        double planned = std::numeric_limits<double>::infinity(), simplified = planned, length = 0;
        for (int repeat = 0; repeat < repeats; ++repeat)
        {
            auto rng = std::make_shared<vamp::rng::Halton<Robot>>();
            RRTCSettings settings;
            settings.range = range;
            settings.max_iterations = settings.max_samples = 1000000;
            const auto found = RRTC<Robot, rake, Robot::resolution>::solve(start, goal, world, settings, rng);
            if (found.path.empty())
            {
                break;
            }
            const auto route = vamp::planning::simplify<Robot, rake, Robot::resolution>(found.path, world, {}, rng);
            planned = std::min(planned, found.nanoseconds / 1e3);
            simplified = std::min(simplified, route.nanoseconds / 1e3);
            length = route.path.cost();
        }
        if (length > 0)
        {
            plan.push_back(planned);
            simplify.push_back(simplified);
            total.push_back(planned + simplified);
            cost.push_back(length);
        }
    }
    std::printf("%s solved %zu / valid %zu / %zu (best of %d)\n", Robot::name, cost.size(), valid, problems.size(), repeats);
    print("plan us", plan);
    print("simplify us", simplify);
    print("plan+simp us", total);
    print("cost rad", cost);
}

int main(int count, char **words)
{
    const std::string folder = count > 1 ? words[1] : ".";
    const int repeats = count > 2 ? std::atoi(words[2]) : 1;
    measure<vamp::robots::Panda>(folder + "/panda.problems", 1.0F, repeats);
    measure<vamp::robots::UR5>(folder + "/ur5.problems", 1.5F, repeats);
}
