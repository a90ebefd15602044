// The C interface over the C++ client: exceptions become return values and error messages.
#include "simgl.h"

#include "simgl.hpp"

#include <algorithm>

struct simgl_client {
    simgl::Client client;
};

namespace {

void tell(char *error, std::size_t size, const char *what) {
    if (error != nullptr && size > 0) std::snprintf(error, size, "%s", what);
}

template <std::size_t N> void copy(const std::array<double, N> &from, double *to) {
    std::copy(from.begin(), from.end(), to);
}

// An invalid argument of the caller.
struct BadArgument : simgl::Error {
    using simgl::Error::Error;
};

void need(const void *pointer, const char *what) {
    if (pointer == nullptr) throw BadArgument(std::string(what) + " is NULL");
}

template <typename T>
void add(std::map<std::string, T> &values, const char *name, const T &value, const char *what) {
    need(name, (std::string("a name of ") + what).c_str());
    if (!values.emplace(name, value).second)
        throw BadArgument(std::string(what) + " has \"" + name + "\" twice");
}

std::map<std::string, double> named(const simgl_setting *settings, std::size_t count,
                                    const char *what) {
    std::map<std::string, double> values;
    if (count > 0) need(settings, what);
    for (std::size_t i = 0; i < count; ++i) add(values, settings[i].name, settings[i].value, what);
    return values;
}

void check_room(const simgl::Camera &card, std::size_t pixel_count) {
    const std::size_t needed =
        static_cast<std::size_t>(card.width) * static_cast<std::size_t>(card.height);
    if (pixel_count < needed)
        throw BadArgument("pixels has room for " + std::to_string(pixel_count) + ", camera \"" +
                          card.name + "\" has " + std::to_string(needed));
}

simgl::Pose pose_of(const simgl_body &body) {
    simgl::Pose pose;
    std::copy_n(body.position_m, 3, pose.position_m.begin());
    std::copy_n(body.velocity_m_s, 3, pose.velocity_m_s.begin());
    std::copy_n(body.q_icrf_from_body_xyzw, 4, pose.q_icrf_from_body_xyzw.begin());
    std::copy_n(body.angular_velocity_rad_s, 3, pose.angular_velocity_rad_s.begin());
    pose.joints = named(body.joints, body.joint_count, "joints");
    return pose;
}

simgl::Scene scene_of(const simgl_scene &scene) {
    simgl::Scene all;
    if (const double *sun = scene.sun_position_m)
        all.sun_position_m = simgl::Vector{sun[0], sun[1], sun[2]};
    all.lamps = named(scene.lamps, scene.lamp_count, "lamps");
    all.moving = scene.moving != 0;
    all.draw = scene.draw;
    return all;
}

void describe(const simgl::Tick &tick, const simgl::Image &image, simgl_image &info) {
    const simgl::Plane &dn = image.plane("dn");
    info.sequence = tick.sequence;
    info.tai_ns = tick.tai_ns;
    info.exposure_start_tai_ns = image.exposure_start_tai_ns;
    info.exposure_end_tai_ns = image.exposure_end_tai_ns;
    info.readout_end_tai_ns = image.readout_end_tai_ns;
    info.available_tai_ns = image.available_tai_ns;
    info.height = static_cast<std::int32_t>(dn.shape.at(0));
    info.width = static_cast<std::int32_t>(dn.shape.at(1));
    info.exposure_time_s = image.exposure_time_s;
    info.gain_dn_per_e = image.gain_dn_per_e;
    copy(image.position_m, info.camera_position_m);
    copy(image.q_camera_from_icrf_xyzw, info.q_camera_from_icrf_xyzw);
    for (int row = 0; row < 3; ++row) copy(image.intrinsics[row], info.intrinsics + 3 * row);
    info.saturated_pixels = image.saturated_pixels.value_or(-1);
    std::snprintf(info.state_hash, sizeof info.state_hash, "%s", tick.state_hash.c_str());
}

} // namespace

simgl_client *simgl_connect(const char *address, double timeout_s, char *error, size_t error_size) {
    const double ready_timeout_s = simgl::Options{}.ready_timeout_s;
    return simgl_connect_ready(address, timeout_s, ready_timeout_s, nullptr, nullptr, error,
                               error_size);
}

simgl_client *simgl_connect_ready(const char *address, double timeout_s, double ready_timeout_s,
                                  simgl_on_status on_status, void *user, char *error,
                                  size_t error_size) {
    try {
        need(address, "address");
        simgl::Options options;
        options.timeout_s = timeout_s;
        options.ready_timeout_s = ready_timeout_s;
        options.name = "c";
        if (on_status != nullptr)
            options.on_status = [=](const simgl::Status &s) {
                on_status(s.state.c_str(), s.detail.c_str(), s.done, s.total, user);
            };
        return new simgl_client{simgl::Client(address, options)};
    } catch (const std::exception &failure) {
        tell(error, error_size, failure.what());
        return nullptr;
    }
}

void simgl_close(simgl_client *client) { delete client; }

int64_t simgl_epoch_tai_ns(const simgl_client *client) {
    return client == nullptr ? 0 : client->client.welcome().epoch_tai_ns;
}

const char *simgl_scene_hash(const simgl_client *client) {
    return client == nullptr ? "" : client->client.welcome().scene_hash.c_str();
}

void simgl_plane_hash(const uint16_t *pixels, size_t pixel_count, char hash[33]) {
    std::vector<unsigned char> bytes(2 * pixel_count);
    for (size_t i = 0; i < pixel_count; ++i) {
        bytes[2 * i] = static_cast<unsigned char>(pixels[i] & 0xff);
        bytes[2 * i + 1] = static_cast<unsigned char>(pixels[i] >> 8);
    }
    std::snprintf(hash, 33, "%s", simgl::detail::blake2b_128(bytes.data(), bytes.size()).c_str());
}

int simgl_camera_size(const simgl_client *client, const char *camera, int32_t *width,
                      int32_t *height) {
    if (client == nullptr || camera == nullptr || width == nullptr || height == nullptr)
        return SIMGL_BAD_ARGUMENT;
    for (const simgl::Camera &card : client->client.welcome().cameras)
        if (card.name == camera) {
            *width = card.width;
            *height = card.height;
            return SIMGL_OK;
        }
    return SIMGL_BAD_ARGUMENT;
}

int simgl_render_dn(simgl_client *client, int64_t tai_ns, const char *camera,
                    const simgl_body *bodies, size_t body_count, double exposure_time_s,
                    uint16_t *pixels, size_t pixel_count, simgl_image *info, char *error,
                    size_t error_size) {
    return simgl_render_scene_dn(client, tai_ns, camera, bodies, body_count, nullptr,
                                 exposure_time_s, pixels, pixel_count, info, error, error_size);
}

int simgl_render_scene_dn(simgl_client *client, int64_t tai_ns, const char *camera,
                          const simgl_body *bodies, size_t body_count, const simgl_scene *scene,
                          double exposure_time_s, uint16_t *pixels, size_t pixel_count,
                          simgl_image *info, char *error, size_t error_size) {
    try {
        need(client, "client");
        need(camera, "camera");
        need(pixels, "pixels");
        if (body_count > 0) need(bodies, "bodies");
        // Checked before sending: the server's time would advance with an image that is lost.
        for (const simgl::Camera &card : client->client.welcome().cameras)
            if (card.name == camera) check_room(card, pixel_count);
        std::map<std::string, simgl::Pose> poses;
        for (size_t i = 0; i < body_count; ++i)
            add(poses, bodies[i].name, pose_of(bodies[i]), "bodies");
        const simgl_scene said = scene == nullptr ? simgl_scene{} : *scene;
        simgl::Shot shot{camera};
        // Zero means not given; the server refuses other invalid values.
        if (exposure_time_s != 0.0) shot.exposure_time_s = exposure_time_s;
        if (said.gain_dn_per_e != 0.0) shot.gain_dn_per_e = said.gain_dn_per_e;
        const simgl::Tick tick =
            client->client.render(tai_ns, {shot}, poses, scene_of(said), said.seek != 0);
        const simgl::Image &image = tick.image(camera);
        const std::vector<std::uint16_t> dn = image.plane("dn").u16();
        if (dn.size() > pixel_count) throw simgl::BadReply("an image is larger than its camera");
        std::copy(dn.begin(), dn.end(), pixels);
        if (info != nullptr) describe(tick, image, *info);
        return SIMGL_OK;
    } catch (const BadArgument &failure) {
        tell(error, error_size, failure.what());
        return SIMGL_BAD_ARGUMENT;
    } catch (const simgl::Refused &failure) {
        tell(error, error_size, failure.what());
        return SIMGL_REFUSED;
    } catch (const simgl::NoAnswer &failure) {
        tell(error, error_size, failure.what());
        return SIMGL_NO_ANSWER;
    } catch (const std::exception &failure) {
        tell(error, error_size, failure.what());
        return SIMGL_BAD_REPLY;
    }
}
