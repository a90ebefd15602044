// Round trips by the C++ client: g++ -std=c++17 -O3 -Ibridge/cpp round_trips.cpp -lzmq
//
// Reads a count a line and answers with as many times [ns], a line each.
#include <simgl.hpp>

#include <algorithm>
#include <iostream>

int main(int, char **argv) {
    simgl::Client client(argv[1], simgl::Options{20.0});
    std::int64_t step = 0;
    for (std::size_t count; std::cin >> count;) {
        std::vector<std::int64_t> times;
        for (std::size_t i = 0; i < count; ++i, ++step) {
            const auto start = std::chrono::steady_clock::now();
            const double there = static_cast<double>(step % 100);
            const simgl::Pose chaser{{0.01 * there, -0.005 * there, 40.0 + 0.02 * there},
                                     {0.0, 0.0, -0.1}};
            const auto tick = client.render(client.welcome().epoch_tai_ns + step, {{"nav"}},
                                            {{"chaser", chaser}});
            const simgl::Plane &dn = tick.image("nav").plane("dn");
            // Read once, as any use of it would.
            const auto *pixels = reinterpret_cast<const std::uint16_t *>(dn.data());
            const std::size_t pixel_count = dn.size() / 2;
            std::uint16_t most = 0;
            for (std::size_t k = 0; k < pixel_count; ++k) most = std::max(most, pixels[k]);
            if (most >= 4000) return 1;
            times.push_back((std::chrono::steady_clock::now() - start).count());
        }
        for (const std::int64_t time : times) std::cout << time << '\n';
        std::cout.flush();
    }
}
