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

std::string key(const char *text, const char *what) {
    need(text, what);
    // An empty one would connect without keys.
    if (text[0] == '\0') throw BadArgument(std::string(what) + " is empty");
    return text;
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

simgl::Options options_of(const simgl_options &said) {
    simgl::Options options;
    options.name = "c";
    // Zero means not given; the client refuses other invalid values.
    if (said.timeout_s != 0.0) options.timeout_s = said.timeout_s;
    if (said.ready_timeout_s != 0.0) options.ready_timeout_s = said.ready_timeout_s;
    if (said.reconnect_timeout_s != 0.0) options.reconnect_timeout_s = said.reconnect_timeout_s;
    options.retry = said.retry != 0;
    if (const simgl_keys *keys = said.keys) {
        options.server_key = key(keys->server, "keys.server");
        options.public_key = key(keys->public_key, "keys.public_key");
        options.secret_key = key(keys->secret_key, "keys.secret_key");
    }
    if (const simgl_on_status on_status = said.on_status)
        options.on_status = [on_status, user = said.user](const simgl::Status &s) {
            on_status(s.state.c_str(), s.detail.c_str(), s.done, s.total, user);
        };
    return options;
}

// Checked before sending: the server's time would advance with an image that is lost.
simgl::Shot shot_of(const simgl_shot &said, const simgl::Welcome &welcome) {
    need(said.camera, "camera");
    need(said.pixels, "pixels");
    for (const simgl::Camera &card : welcome.cameras)
        if (card.name == said.camera) check_room(card, said.pixel_count);
    simgl::Shot shot{said.camera};
    if (said.exposure_time_s != 0.0) shot.exposure_time_s = said.exposure_time_s;
    if (said.gain_dn_per_e != 0.0) shot.gain_dn_per_e = said.gain_dn_per_e;
    return shot;
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

void render(simgl::Client &client, std::int64_t tai_ns, const simgl_shot *shots,
            std::size_t shot_count, const simgl_body *bodies, std::size_t body_count,
            const simgl_scene &scene) {
    std::vector<simgl::Shot> asked;
    for (std::size_t i = 0; i < shot_count; ++i)
        asked.push_back(shot_of(shots[i], client.welcome()));
    if (body_count > 0) need(bodies, "bodies");
    std::map<std::string, simgl::Pose> poses;
    for (std::size_t i = 0; i < body_count; ++i)
        add(poses, bodies[i].name, pose_of(bodies[i]), "bodies");
    const simgl::Tick tick = client.render(tai_ns, asked, poses, scene_of(scene), scene.seek != 0);
    for (std::size_t i = 0; i < shot_count; ++i) {
        const simgl::Image &image = tick.image(shots[i].camera);
        const simgl::Plane &dn = image.plane("dn");
        if (dn.size() / 2 > shots[i].pixel_count)
            throw simgl::BadReply("an image is larger than its camera");
        dn.copy_u16(shots[i].pixels);
        if (shots[i].info != nullptr) describe(tick, image, *shots[i].info);
    }
}

// The code of what a call throws, and its message.
template <typename Call> int code_of(char *error, std::size_t error_size, Call call) {
    int code = SIMGL_OK;
    try {
        call();
    } catch (const BadArgument &failure) {
        code = SIMGL_BAD_ARGUMENT;
        tell(error, error_size, failure.what());
    } catch (const simgl::Refused &failure) {
        code = SIMGL_REFUSED;
        tell(error, error_size, failure.what());
    } catch (const simgl::NoAnswer &failure) {
        code = SIMGL_NO_ANSWER;
        tell(error, error_size, failure.what());
    } catch (const std::exception &failure) {
        code = SIMGL_BAD_REPLY;
        tell(error, error_size, failure.what());
    }
    return code;
}

} // namespace

simgl_client *simgl_connect(const char *address, double timeout_s, char *error, size_t error_size) {
    simgl_options options{};
    options.timeout_s = timeout_s;
    return simgl_connect_with(address, &options, error, error_size);
}

simgl_client *simgl_connect_with(const char *address, const simgl_options *options, char *error,
                                 size_t error_size) {
    try {
        need(address, "address");
        return new simgl_client{
            simgl::Client(address, options_of(options == nullptr ? simgl_options{} : *options))};
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
    return code_of(error, error_size, [=] {
        need(client, "client");
        const simgl_scene said = scene == nullptr ? simgl_scene{} : *scene;
        const simgl_shot shot{camera, exposure_time_s, said.gain_dn_per_e,
                              pixels, pixel_count,     info};
        render(client->client, tai_ns, &shot, 1, bodies, body_count, said);
    });
}

int simgl_render_cameras_dn(simgl_client *client, int64_t tai_ns, const simgl_shot *shots,
                            size_t shot_count, const simgl_body *bodies, size_t body_count,
                            const simgl_scene *scene, char *error, size_t error_size) {
    return code_of(error, error_size, [=] {
        need(client, "client");
        if (shot_count > 0) need(shots, "shots");
        const simgl_scene said = scene == nullptr ? simgl_scene{} : *scene;
        if (said.gain_dn_per_e != 0.0)
            throw BadArgument("scene.gain_dn_per_e: each of several cameras has its own gain");
        render(client->client, tai_ns, shots, shot_count, bodies, body_count, said);
    });
}
