// A GNC loop that steers by brightness: g++ -std=c++17 -Ibridge/cpp gnc_stub.cpp -lzmq
#include <simgl.hpp>

#include <iostream>

int main(int argc, char **argv) {
    try {
        simgl::Client client(argc > 1 ? argv[1] : "tcp://127.0.0.1:5563");
        const simgl::Camera camera = client.welcome().cameras.at(0);
        simgl::Pose chaser{{1.0, 0.0, 60.0}, {0.0, 0.0, -0.5}};
        for (std::int64_t step = 0; step < 20; ++step) {
            const std::int64_t now = client.welcome().epoch_tai_ns + step * 1'000'000'000;
            const auto tick = client.render(now, {{camera.name}}, {{"chaser", chaser}});
            const auto dn = tick.image(camera.name).plane("dn").u16();
            double sum = 0.0, column = 0.0;
            for (std::size_t i = 0; i < dn.size(); ++i) {
                const double light = dn[i] > camera.pedestal_dn + 50 ? dn[i] : 0.0;
                sum += light;
                column += light * (static_cast<double>(i % camera.width) + 0.5);
            }
            const double off_axis = sum > 0.0 ? (column / sum - camera.cx) / camera.focal_length_px : 0.0;
            chaser.velocity_m_s[0] += 0.2 * off_axis;
            for (int axis = 0; axis < 3; ++axis) chaser.position_m[axis] += chaser.velocity_m_s[axis];
            std::cout << step << ' ' << tick.state_hash << ' ' << off_axis << '\n';
        }
    } catch (const std::exception &error) {
        return std::cerr << error.what() << '\n', 1;
    }
}
