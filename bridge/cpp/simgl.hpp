// A client of simgl's image service, protocol simgl/1, for C++17. Needs libzmq and nothing else:
//
//     g++ -std=c++17 loop.cpp -lzmq
//
//     simgl::Client client("tcp://127.0.0.1:5563");
//     auto tick = client.render(client.welcome().epoch_tai_ns, {{"navcam"}}, {{"chaser", pose}});
//     std::vector<std::uint16_t> dn = tick.image("navcam").plane("dn").u16();
//
// Every call ends after the client's timeout. A reply is returned only if it shows the state that
// was sent: the client recomputes its hash. Errors are exceptions: Refused (with the server's
// reason), NoAnswer (server not running or blocked; at once where the connection breaks) or
// BadReply. After a NoAnswer the client can be used on. Use a client on one thread.
//
// Units are in the names; positions Earth-centred in ICRF axes, times TAI nanoseconds since
// 1970-01-01T00:00:00 TAI, quaternions Hamilton, scalar last. docs/protocol.md has every message.
#ifndef SIMGL_HPP
#define SIMGL_HPP

#include <zmq.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace simgl {

using Vector = std::array<double, 3>;
using Quaternion = std::array<double, 4>;

// Base of all errors; the message is one line.
struct Error : std::runtime_error {
    using std::runtime_error::runtime_error;
};

// The server refused a request: code and field as in docs/protocol.md.
struct Refused : Error {
    std::string code, field;
    bool retryable;
    Refused(const std::string &what, std::string code, std::string field, bool retryable)
        : Error(what), code(std::move(code)), field(std::move(field)), retryable(retryable) {}
};

// No reply within the timeout, or the connection broke.
struct NoAnswer : Error {
    using Error::Error;
};

// A reply that does not answer the request.
struct BadReply : Error {
    using Error::Error;
};

// Position, velocity, attitude and joints (rad or m) of a spacecraft.
struct Pose {
    Vector position_m{}, velocity_m_s{};
    Quaternion q_icrf_from_body_xyzw{0.0, 0.0, 0.0, 1.0};
    std::map<std::string, double> joints{};
    Vector angular_velocity_rad_s{}; // body axes; used where a request sets moving
};

// Optional parts of a request. Lamps burn with a share of their power, 0 to 1, those left out
// fully; with moving, bodies move with their rates while the shutter is open. Images of one time that
// differ in draw differ in their noise.
struct Scene {
    std::optional<Vector> sun_position_m{};
    std::map<std::string, double> lamps{};
    bool moving = false;
    std::uint32_t draw = 0;

    Scene() = default;
    Scene(const Vector &sun) : sun_position_m(sun) {}
    Scene(std::optional<Vector> sun, std::map<std::string, double> dimmed = {}, bool moves = false)
        : sun_position_m(sun), lamps(std::move(dimmed)), moving(moves) {}
};

// The request to one camera; values left out are the camera's own.
struct Shot {
    std::string camera;
    std::optional<double> exposure_time_s{}, gain_dn_per_e{};
    std::vector<std::string> products{"dn"};
};

// A camera of the server; pixel (i, j) has its centre at (i + 0.5, j + 0.5).
struct Camera {
    std::string name;
    int width, height, bits;
    double pedestal_dn, full_well_e, gain_dn_per_e, focal_length_px, cx, cy;
    double exposure_time_s, readout_time_s, transport_latency_s;
};

// The server's description of itself.
struct Welcome {
    std::string server, boot, renderer, scenario, scene_hash;
    std::int64_t epoch_tai_ns;
    std::uint64_t seed, window;
    std::vector<Camera> cameras;
    std::vector<std::string> bodies;

    const Camera &camera(const std::string &name) const {
        for (const Camera &camera : cameras)
            if (camera.name == name) return camera;
        throw Error("no camera \"" + name + "\" in scenario \"" + scenario + "\"");
    }
};

namespace detail {

// A frame of a message, freed with its last owner; pixels are not copied.
class Frame {
  public:
    Frame() : message_(new zmq_msg_t, [](zmq_msg_t *m) { zmq_msg_close(m); delete m; }) {
        zmq_msg_init(message_.get());
    }
    zmq_msg_t *get() const { return message_.get(); }
    const unsigned char *data() const {
        return static_cast<const unsigned char *>(zmq_msg_data(message_.get()));
    }
    std::size_t size() const { return zmq_msg_size(message_.get()); }

  private:
    std::shared_ptr<zmq_msg_t> message_;
};

// The part of MessagePack that simgl/1 uses.
class Writer {
  public:
    std::string bytes;

    Writer &map(std::size_t n) { return head(n, 0x80, 0xde); }
    Writer &array(std::size_t n) { return head(n, 0x90, 0xdc); }
    Writer &nil() { return byte(0xc0); }
    Writer &boolean(bool v) { return byte(v ? 0xc3 : 0xc2); }
    Writer &real(double v) {
        std::uint64_t bits;
        std::memcpy(&bits, &v, 8);
        return byte(0xcb).big_endian(bits, 8);
    }
    Writer &whole(std::int64_t v) {
        if (v >= 0) return natural(static_cast<std::uint64_t>(v));
        if (v >= -32) return byte(static_cast<unsigned>(v) & 0xff);
        if (v >= INT8_MIN) return byte(0xd0).big_endian(static_cast<std::uint64_t>(v), 1);
        if (v >= INT16_MIN) return byte(0xd1).big_endian(static_cast<std::uint64_t>(v), 2);
        if (v >= INT32_MIN) return byte(0xd2).big_endian(static_cast<std::uint64_t>(v), 4);
        return byte(0xd3).big_endian(static_cast<std::uint64_t>(v), 8);
    }
    Writer &natural(std::uint64_t v) {
        if (v < 0x80) return byte(static_cast<unsigned>(v));
        if (v <= UINT8_MAX) return byte(0xcc).big_endian(v, 1);
        if (v <= UINT16_MAX) return byte(0xcd).big_endian(v, 2);
        if (v <= UINT32_MAX) return byte(0xce).big_endian(v, 4);
        return byte(0xcf).big_endian(v, 8);
    }
    Writer &text(const std::string &v) {
        if (v.size() < 32) byte(0xa0 | static_cast<unsigned>(v.size()));
        else if (v.size() <= UINT8_MAX) byte(0xd9).big_endian(v.size(), 1);
        else byte(0xda).big_endian(v.size(), 2);
        bytes += v;
        return *this;
    }
    template <std::size_t N> Writer &reals(const std::array<double, N> &values) {
        array(N);
        for (double v : values) real(v);
        return *this;
    }

  private:
    Writer &byte(unsigned v) {
        bytes.push_back(static_cast<char>(v));
        return *this;
    }
    Writer &big_endian(std::uint64_t v, int size) {
        for (int i = size - 1; i >= 0; --i) byte((v >> (8 * i)) & 0xff);
        return *this;
    }
    Writer &head(std::size_t n, unsigned small, unsigned large) {
        if (n < 16) return byte(small | static_cast<unsigned>(n));
        return byte(large).big_endian(n, 2);
    }
};

// A decoded header: a tree of values, read by key and type.
class Value {
  public:
    enum class Kind { nil, boolean, whole, natural, real, text, array, map };

    static Value decode(const unsigned char *data, std::size_t size) {
        Reader reader{data, data + size};
        Value value = reader.value(0);
        if (reader.at != reader.end) throw BadReply("trailing bytes in a header");
        return value;
    }

    bool is_nil() const { return kind_ == Kind::nil; }
    bool has(const std::string &key) const {
        for (const auto &item : map_)
            if (item.first.kind_ == Kind::text && item.first.text_ == key) return true;
        return false;
    }
    const Value &operator[](const std::string &key) const {
        for (const auto &item : map_)
            if (item.first.kind_ == Kind::text && item.first.text_ == key) return item.second;
        throw BadReply("a reply has no \"" + key + "\"");
    }
    const std::vector<Value> &items() const { return expect(Kind::array), array_; }
    const std::vector<std::pair<Value, Value>> &entries() const { return expect(Kind::map), map_; }
    const std::string &text() const { return expect(Kind::text), text_; }
    bool boolean() const { return expect(Kind::boolean), natural_ != 0; }
    double real() const {
        if (kind_ == Kind::real) return real_;
        if (kind_ == Kind::whole) return static_cast<double>(static_cast<std::int64_t>(natural_));
        return expect(Kind::natural), static_cast<double>(natural_);
    }
    std::int64_t whole() const {
        if (kind_ == Kind::whole) return static_cast<std::int64_t>(natural_);
        expect(Kind::natural);
        if (natural_ > INT64_MAX) throw BadReply("a number of a reply is too large");
        return static_cast<std::int64_t>(natural_);
    }
    std::uint64_t natural() const { return expect(Kind::natural), natural_; }
    template <std::size_t N> std::array<double, N> reals() const {
        if (items().size() != N) throw BadReply("a list of a reply has the wrong length");
        std::array<double, N> values;
        for (std::size_t i = 0; i < N; ++i) values[i] = array_[i].real();
        return values;
    }

  private:
    struct Reader {
        const unsigned char *at, *end;

        std::uint64_t number(std::size_t size) {
            if (static_cast<std::size_t>(end - at) < size) throw BadReply("a header is cut off");
            std::uint64_t v = 0;
            for (std::size_t i = 0; i < size; ++i) v = v << 8 | *at++;
            return v;
        }
        // Each item takes at least a byte, so a length beyond the end is invalid: nothing is
        // allocated for it.
        std::size_t length(std::uint64_t n) const {
            if (n > static_cast<std::uint64_t>(end - at)) throw BadReply("a header is cut off");
            return static_cast<std::size_t>(n);
        }
        Value value(int depth) {
            if (depth > 32) throw BadReply("a header is nested too deeply");
            const unsigned head = static_cast<unsigned>(number(1));
            if (head < 0x80) return of(Kind::natural, head);
            if (head < 0x90) return map(head & 15, depth);
            if (head < 0xa0) return array(head & 15, depth);
            if (head < 0xc0) return text(head & 31);
            if (head >= 0xe0) return signed_of(static_cast<std::int8_t>(head));
            switch (head) {
            case 0xc0: return Value{};
            case 0xc2: case 0xc3: return of(Kind::boolean, head & 1);
            case 0xca: { std::uint32_t b = static_cast<std::uint32_t>(number(4)); float f;
                         std::memcpy(&f, &b, 4); return real(static_cast<double>(f)); }
            case 0xcb: { std::uint64_t b = number(8); double d; std::memcpy(&d, &b, 8);
                         return real(d); }
            case 0xcc: return of(Kind::natural, number(1));
            case 0xcd: return of(Kind::natural, number(2));
            case 0xce: return of(Kind::natural, number(4));
            case 0xcf: return of(Kind::natural, number(8));
            case 0xd0: return signed_of(static_cast<std::int8_t>(number(1)));
            case 0xd1: return signed_of(static_cast<std::int16_t>(number(2)));
            case 0xd2: return signed_of(static_cast<std::int32_t>(number(4)));
            case 0xd3: return signed_of(static_cast<std::int64_t>(number(8)));
            case 0xd9: return text(number(1));
            case 0xda: return text(number(2));
            case 0xdb: return text(number(4));
            case 0xdc: return array(number(2), depth);
            case 0xdd: return array(number(4), depth);
            case 0xde: return map(number(2), depth);
            case 0xdf: return map(number(4), depth);
            default: throw BadReply("a header holds what simgl/1 does not use");
            }
        }
        static Value of(Kind kind, std::uint64_t v) {
            Value value;
            value.kind_ = kind;
            value.natural_ = v;
            return value;
        }
        static Value signed_of(std::int64_t v) {
            return of(v < 0 ? Kind::whole : Kind::natural, static_cast<std::uint64_t>(v));
        }
        static Value real(double v) {
            Value value;
            value.kind_ = Kind::real;
            value.real_ = v;
            return value;
        }
        Value text(std::uint64_t n) {
            Value value;
            value.kind_ = Kind::text;
            value.text_.assign(reinterpret_cast<const char *>(at), length(n));
            at += n;
            return value;
        }
        Value array(std::uint64_t n, int depth) {
            Value value;
            value.kind_ = Kind::array;
            value.array_.reserve(length(n));
            for (std::uint64_t i = 0; i < n; ++i) value.array_.push_back(this->value(depth + 1));
            return value;
        }
        Value map(std::uint64_t n, int depth) {
            Value value;
            value.kind_ = Kind::map;
            value.map_.reserve(length(n));
            for (std::uint64_t i = 0; i < n; ++i) {
                Value key = this->value(depth + 1);
                value.map_.emplace_back(std::move(key), this->value(depth + 1));
            }
            return value;
        }
    };

    void expect(Kind kind) const {
        if (kind_ != kind) throw BadReply("a field of a reply has another type");
    }

    Kind kind_ = Kind::nil;
    std::uint64_t natural_ = 0;
    double real_ = 0.0;
    std::string text_;
    std::vector<Value> array_;
    std::vector<std::pair<Value, Value>> map_;
};

// BLAKE2b with 16 bytes, in hexadecimal digits (RFC 7693).
inline std::string blake2b_128(const unsigned char *content, std::size_t size) {
    static const std::uint64_t iv[8] = {
        0x6a09e667f3bcc908, 0xbb67ae8584caa73b, 0x3c6ef372fe94f82b, 0xa54ff53a5f1d36f1,
        0x510e527fade682d1, 0x9b05688c2b3e6c1f, 0x1f83d9abfb41bd6b, 0x5be0cd19137e2179};
    static const unsigned char sigma[10][16] = {
        {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15},
        {14, 10, 4, 8, 9, 15, 13, 6, 1, 12, 0, 2, 11, 7, 5, 3},
        {11, 8, 12, 0, 5, 2, 15, 13, 10, 14, 3, 6, 7, 1, 9, 4},
        {7, 9, 3, 1, 13, 12, 11, 14, 2, 6, 5, 10, 4, 0, 15, 8},
        {9, 0, 5, 7, 2, 4, 10, 15, 14, 1, 11, 12, 6, 8, 3, 13},
        {2, 12, 6, 10, 0, 11, 8, 3, 4, 13, 7, 5, 15, 14, 1, 9},
        {12, 5, 1, 15, 14, 13, 4, 10, 0, 7, 6, 3, 9, 2, 8, 11},
        {13, 11, 7, 14, 12, 1, 3, 9, 5, 0, 15, 4, 8, 6, 2, 10},
        {6, 15, 14, 9, 11, 3, 0, 8, 12, 2, 13, 7, 1, 4, 10, 5},
        {10, 2, 8, 4, 7, 6, 1, 5, 15, 11, 9, 14, 3, 12, 13, 0}};
    std::uint64_t h[8];
    std::memcpy(h, iv, sizeof h);
    h[0] ^= 0x01010000 ^ 16;
    const std::size_t blocks = size == 0 ? 1 : (size + 127) / 128;
    for (std::size_t block = 0; block < blocks; ++block) {
        const bool last = block + 1 == blocks;
        std::uint64_t m[16] = {}, v[16];
        unsigned char padded[128] = {};
        const unsigned char *at = content + block * 128;
        if (last) {
            std::copy(at, content + size, padded);
            at = padded;
        }
        // Eight bytes that follow each other: compilers make one load of them.
        for (std::uint64_t &word : m)
            for (int i = 0; i < 8; ++i) word |= static_cast<std::uint64_t>(*at++) << (8 * i);
        std::memcpy(v, h, sizeof h);
        std::memcpy(v + 8, iv, sizeof iv);
        v[12] ^= last ? size : (block + 1) * 128;
        if (last) v[14] = ~v[14];
        const auto turn = [](std::uint64_t x, int n) { return x >> n | x << (64 - n); };
        const auto mix = [&](int a, int b, int c, int d, std::uint64_t x, std::uint64_t y) {
            v[a] += v[b] + x; v[d] = turn(v[d] ^ v[a], 32);
            v[c] += v[d];     v[b] = turn(v[b] ^ v[c], 24);
            v[a] += v[b] + y; v[d] = turn(v[d] ^ v[a], 16);
            v[c] += v[d];     v[b] = turn(v[b] ^ v[c], 63);
        };
        for (int round = 0; round < 12; ++round) {
            const unsigned char *s = sigma[round % 10];
            for (int i = 0; i < 4; ++i) mix(i, i + 4, i + 8, i + 12, m[s[2 * i]], m[s[2 * i + 1]]);
            for (int i = 0; i < 4; ++i)
                mix(i, (i + 1) % 4 + 4, (i + 2) % 4 + 8, (i + 3) % 4 + 12, m[s[8 + 2 * i]],
                    m[s[9 + 2 * i]]);
        }
        for (int i = 0; i < 8; ++i) h[i] ^= v[i] ^ v[i + 8];
    }
    std::string digits;
    for (int i = 0; i < 16; ++i) {
        char two[3];
        std::snprintf(two, sizeof two, "%02x", static_cast<unsigned>(h[i / 8] >> (8 * (i % 8)) & 0xff));
        digits += two;
    }
    return digits;
}

inline std::string blake2b_128(const std::string &content) {
    return blake2b_128(reinterpret_cast<const unsigned char *>(content.data()), content.size());
}

} // namespace detail

// One product of an image: row-major, row 0 at the top, little-endian as received.
class Plane {
  public:
    std::string product, dtype, unit;
    std::vector<std::size_t> shape;

    const unsigned char *data() const { return frame_.data(); }
    std::size_t size() const { return frame_.size(); }
    // Hash of the content, as records of sessions have it: BLAKE2b with 16 bytes.
    std::string hash() const { return detail::blake2b_128(data(), size()); }
    // The pixels in the byte order of this machine, big-endian ones too.
    std::vector<std::uint16_t> u16() const { return numbers<std::uint16_t>("<u2"); }
    std::vector<std::uint32_t> u32() const { return numbers<std::uint32_t>("<u4"); }
    std::vector<float> f32() const { return numbers<float>("<f4"); }
    // u16() into memory of the caller, which has room for size() / 2 pixels.
    void copy_u16(std::uint16_t *pixels) const { copy("<u2", pixels); }

  private:
    friend class Client;
    detail::Frame frame_;

    template <typename T> std::vector<T> numbers(const char *wanted) const {
        std::vector<T> values(size() / sizeof(T));
        copy(wanted, values.data());
        return values;
    }
    template <typename T> void copy(const char *wanted, T *values) const {
        if (dtype != wanted) throw Error("plane \"" + product + "\" holds " + dtype);
        if (size() == 0) return;
        std::memcpy(values, data(), size());
        if (!is_big_endian()) return;
        auto *bytes = reinterpret_cast<unsigned char *>(values);
        for (std::size_t i = 0; i < size(); i += sizeof(T))
            std::reverse(bytes + i, bytes + i + sizeof(T));
    }
    static bool is_big_endian() {
        const std::uint16_t one = 1;
        unsigned char first;
        std::memcpy(&first, &one, 1);
        return first == 0;
    }
};

// The image of one camera, with the values that were used.
struct Image {
    std::string camera;
    Vector position_m;
    Quaternion q_camera_from_icrf_xyzw;
    std::array<Vector, 3> intrinsics;
    double exposure_time_s, gain_dn_per_e;
    std::int64_t exposure_start_tai_ns, exposure_end_tai_ns, readout_end_tai_ns, available_tai_ns;
    Vector sun_direction_icrf;
    Quaternion sun_irradiance_w_m2;
    std::optional<std::int64_t> saturated_pixels;
    std::vector<Plane> planes;

    const Plane &plane(const std::string &product) const {
        for (const Plane &plane : planes)
            if (plane.product == product) return plane;
        throw Error("image of \"" + camera + "\" has no \"" + product + "\"");
    }
};

// The images of one request.
struct Tick {
    std::uint64_t sequence, seed;
    std::int64_t tai_ns;
    std::string state_hash, scene_hash, boot;
    std::vector<Image> images;

    const Image &image(const std::string &camera) const {
        for (const Image &image : images)
            if (image.camera == camera) return image;
        throw Error("no image of \"" + camera + "\" in this tick");
    }
};

// What a server is doing: "starting", "ready", "drawing" or "lost"; detail says what it prepares, or
// why its renderer was lost; total is 0 where steps are not counted.
struct Status {
    std::string state, detail;
    std::int64_t done = 0, total = 0;
};

// Options of a connection. The constructor waits up to ready_timeout_s for a server that is
// starting, and calls on_status meanwhile; every other call ends after timeout_s, and after
// reconnect_timeout_s where the connection broke before it and is not back. With retry, a request
// over which the server lost its renderer or its GPU is sent once more, with another timeout_s.
// Keys are for a server that requires them, in ZeroMQ's Z85 form: the strings after public-key and
// secret-key in the files that simgl keys makes.
struct Options {
    double timeout_s = 10.0;
    std::string name = "c++";
    std::string server_key{}, public_key{}, secret_key{};
    double ready_timeout_s = 600.0;
    std::function<void(const Status &)> on_status{};
    std::optional<double> reconnect_timeout_s{};
    bool retry = false;
};

class Client {
  public:
    explicit Client(std::string address, Options options = {})
        : address_(std::move(address)), timeout_s_(options.timeout_s),
          reconnect_timeout_s_(options.reconnect_timeout_s.value_or(options.timeout_s)),
          retry_(options.retry) {
        check("timeout_s", timeout_s_);
        check("ready_timeout_s", options.ready_timeout_s);
        check("reconnect_timeout_s", reconnect_timeout_s_);
        context_.reset(zmq_ctx_new());
        socket_.reset(zmq_socket(context_.get(), ZMQ_DEALER));
        set_up(options);
        greet(options);
    }
    Client(const Client &) = delete;
    Client &operator=(const Client &) = delete;
    ~Client() {
        try {
            detail::Writer bye;
            bye.map(1).text("type").text("bye");
            if (connected_) send(bye.bytes);
        } catch (const Error &) {
            // A client may leave without a goodbye.
        }
        // Time to send the goodbye.
        set(ZMQ_LINGER, 100);
    }

    const Welcome &welcome() const { return welcome_; }
    // Times that the server was restarted with the same scene.
    int restarts() const { return restarts_; }
    double timeout_s() const { return timeout_s_; }

    // The images that cameras take of one state. tai_ns is mid-exposure; bodies left out follow
    // the scenario's own laws; seek allows a time before the last request's.
    Tick render(std::int64_t tai_ns, const std::vector<Shot> &cameras,
                const std::map<std::string, Pose> &bodies = {}, const Scene &scene = {},
                bool seek = false) {
        const std::uint64_t id = ++last_id_;
        const std::string sent = request(id, tai_ns, cameras, bodies, scene, seek);
        return checked(images(sent, id), tai_ns, cameras, bodies, scene);
    }

    // Round-trip time [s].
    double ping() {
        const std::uint64_t id = ++last_id_;
        const auto start = Clock::now();
        detail::Writer w;
        w.map(2).text("type").text("ping").text("id").natural(id);
        ask(w.bytes, "pong", id, "ping");
        return std::chrono::duration<double>(Clock::now() - start).count();
    }

  private:
    using Clock = std::chrono::steady_clock;
    struct Reply {
        detail::Value header;
        std::vector<detail::Frame> planes;
    };
    struct End {
        void operator()(void *context) const { zmq_ctx_term(context); }
    };
    struct Close {
        void operator()(void *socket) const { zmq_close(socket); }
    };

    static void check(const char *name, double seconds) {
        if (!(seconds > 0.0 && seconds < 1e6))
            throw Error(std::string(name) + " must lie in 0..1e6 s");
    }

    void set(int option, int value) { zmq_setsockopt(socket_.get(), option, &value, sizeof value); }
    void set(int option, const std::string &value) {
        if (zmq_setsockopt(socket_.get(), option, value.data(), value.size()) != 0)
            throw Error("a key is not in ZeroMQ's Z85 form");
    }

    void set_up(const Options &options) {
        set(ZMQ_LINGER, 0);
        set(ZMQ_RECONNECT_IVL, 50);
        set(ZMQ_HEARTBEAT_IVL, 1000);
        set(ZMQ_HEARTBEAT_TIMEOUT, 10000);
        // The largest plane: radiance of 16384 x 16384 pixels. Longer frames break the connection.
        const std::int64_t largest = std::int64_t{16384} * 16384 * 16;
        zmq_setsockopt(socket_.get(), ZMQ_MAXMSGSIZE, &largest, sizeof largest);
        if (address_.rfind("tcp://[", 0) == 0) set(ZMQ_IPV6, 1);
        // Of the loopback: the system would grow it until images no longer fit the processor's cache.
        for (const char *host : {"tcp://127.", "tcp://localhost:", "tcp://[::1]:"})
            if (address_.rfind(host, 0) == 0) set(ZMQ_RCVBUF, 512 * 1024);
        // Clients of one name must not take over each other's identity.
        std::random_device random;
        char identity[48];
        std::snprintf(identity, sizeof identity, "%08x%08x%08x-c++", random(), random(), random());
        set(ZMQ_ROUTING_ID, std::string(identity));
        if (!options.server_key.empty()) {
            set(ZMQ_CURVE_SERVERKEY, options.server_key);
            set(ZMQ_CURVE_PUBLICKEY, options.public_key);
            set(ZMQ_CURVE_SECRETKEY, options.secret_key);
        }
        const int events = ZMQ_EVENT_HANDSHAKE_SUCCEEDED | ZMQ_EVENT_DISCONNECTED | failed_;
        zmq_socket_monitor(socket_.get(), "inproc://simgl-monitor", events);
        monitor_.reset(zmq_socket(context_.get(), ZMQ_PAIR));
        zmq_connect(monitor_.get(), "inproc://simgl-monitor");
        if (zmq_connect(socket_.get(), address_.c_str()) != 0)
            throw Error(address_ + ": is not an address (" + zmq_strerror(zmq_errno()) + ")");
    }

    void greet(const Options &options) {
        detail::Writer w;
        w.map(3).text("type").text("hello").text("client").text(options.name);
        w.text("versions").array(1).text("simgl/1");
        const Reply reply = ask(w.bytes, "welcome", 0, "hello", &options);
        const detail::Value &h = reply.header;
        welcome_.server = h["server"].text();
        welcome_.boot = boot_ = h["boot"].text();
        welcome_.renderer = h["renderer"].text();
        welcome_.scenario = h["scenario"].text();
        welcome_.scene_hash = h["scene_hash"].text();
        welcome_.epoch_tai_ns = h["epoch_tai_ns"].whole();
        welcome_.seed = h["seed"].natural();
        welcome_.window = h["window"].natural();
        for (const detail::Value &c : h["cameras"].items())
            welcome_.cameras.push_back(
                {c["name"].text(), static_cast<int>(c["width"].whole()),
                 static_cast<int>(c["height"].whole()), static_cast<int>(c["bits"].whole()),
                 c["pedestal_dn"].real(), c["full_well_e"].real(), c["gain_dn_per_e"].real(),
                 c["focal_length_px"].real(), c["cx"].real(), c["cy"].real(),
                 c["exposure_time_s"].real(), c["readout_time_s"].real(),
                 c["transport_latency_s"].real()});
        for (const auto &body : h["bodies"].entries())
            welcome_.bodies.push_back(body.first.text());
    }

    // Time for the server to answer that it cannot, before this client gives up; a server accepts
    // at most an hour.
    std::uint64_t server_deadline_ms() const {
        const double seconds = std::min(3600.0, std::max(0.5 * timeout_s_, timeout_s_ - 0.2));
        return std::max<std::uint64_t>(1, static_cast<std::uint64_t>(1000.0 * seconds));
    }

    std::string request(std::uint64_t id, std::int64_t tai_ns, const std::vector<Shot> &cameras,
                        const std::map<std::string, Pose> &bodies, const Scene &scene,
                        bool seek) const {
        detail::Writer w;
        w.map(scene.sun_position_m ? 11 : 10).text("type").text("render").text("id").natural(id);
        w.text("tai_ns").whole(tai_ns).text("seek").boolean(seek);
        w.text("deadline_ms").natural(server_deadline_ms());
        w.text("cameras").array(cameras.size());
        for (const Shot &shot : cameras) {
            w.map(4).text("camera").text(shot.camera).text("exposure_time_s");
            shot.exposure_time_s ? w.real(*shot.exposure_time_s) : w.nil();
            w.text("gain_dn_per_e");
            shot.gain_dn_per_e ? w.real(*shot.gain_dn_per_e) : w.nil();
            w.text("products").array(shot.products.size());
            for (const std::string &product : shot.products) w.text(product);
        }
        w.text("bodies").map(bodies.size());
        for (const auto &[name, pose] : bodies) {
            w.text(name).map(5).text("position_m").reals(pose.position_m);
            w.text("velocity_m_s").reals(pose.velocity_m_s);
            w.text("q_icrf_from_body_xyzw").reals(pose.q_icrf_from_body_xyzw);
            w.text("joints").map(pose.joints.size());
            for (const auto &[joint, value] : pose.joints) w.text(joint).real(value);
            w.text("angular_velocity_rad_s").reals(pose.angular_velocity_rad_s);
        }
        w.text("lamps").map(scene.lamps.size());
        for (const auto &[lamp, share] : scene.lamps) w.text(lamp).real(share);
        w.text("moving").boolean(scene.moving).text("draw").natural(scene.draw);
        if (scene.sun_position_m)
            w.text("sun").map(1).text("position_m").reals(*scene.sun_position_m);
        return w.bytes;
    }

    // The hash of the state that was sent, as the server computes it; see docs/protocol.md.
    std::string state_hash(std::int64_t tai_ns, const std::vector<Shot> &cameras,
                           const std::map<std::string, Pose> &bodies, const Scene &scene) const {
        detail::Writer w;
        const bool more = !scene.lamps.empty() || scene.moving || scene.draw != 0;
        w.array(scene.draw != 0 ? 7 : more ? 6 : 5).whole(tai_ns).array(bodies.size());
        for (const auto &[name, pose] : bodies) {
            w.array(5).text(name).reals(pose.position_m).reals(pose.velocity_m_s);
            w.reals(pose.q_icrf_from_body_xyzw).array(pose.joints.size());
            for (const auto &[joint, value] : pose.joints) w.array(2).text(joint).real(value);
        }
        scene.sun_position_m ? w.reals(*scene.sun_position_m) : w.nil();
        w.array(cameras.size());
        for (const Shot &shot : cameras) {
            const Camera &own = welcome_.camera(shot.camera);
            w.array(3).text(shot.camera);
            w.real(shot.exposure_time_s.value_or(own.exposure_time_s));
            w.real(shot.gain_dn_per_e.value_or(own.gain_dn_per_e));
        }
        w.natural(welcome_.seed);
        if (more) {
            w.array(2).array(scene.lamps.size());
            for (const auto &[lamp, share] : scene.lamps) w.array(2).text(lamp).real(share);
            if (scene.moving) {
                w.array(bodies.size());
                for (const auto &[name, pose] : bodies)
                    w.array(2).text(name).reals(pose.angular_velocity_rad_s);
            } else {
                w.nil();
            }
        }
        if (scene.draw != 0) w.natural(scene.draw);
        return detail::blake2b_128(w.bytes);
    }

    Reply images(const std::string &sent, std::uint64_t id) {
        try {
            return ask(sent, "images", id, "render");
        } catch (const Refused &failure) {
            // The server starts another renderer, and an image depends on its request alone.
            if (!retry_ || (failure.code != "RENDERER_LOST" && failure.code != "GPU_LOST")) throw;
        }
        return ask(sent, "images", id, "render");
    }

    Tick checked(const Reply &reply, std::int64_t tai_ns, const std::vector<Shot> &cameras,
                 const std::map<std::string, Pose> &bodies, const Scene &scene) {
        const detail::Value &h = reply.header;
        Tick tick{h["sequence"].natural(), h["seed"].natural(), h["tai_ns"].whole(),
                  h["state_hash"].text(), h["scene_hash"].text(), h["boot"].text(), {}};
        if (tick.scene_hash != welcome_.scene_hash || tick.seed != welcome_.seed)
            throw BadReply(address_ + ": the server shows another scene now; connect again");
        if (tick.tai_ns != tai_ns || tick.state_hash != state_hash(tai_ns, cameras, bodies, scene))
            throw BadReply(address_ + ": image " + std::to_string(tick.sequence) +
                           " shows another state than the one sent");
        restarts_ += tick.boot != boot_;
        boot_ = tick.boot;
        std::size_t frame = 0;
        for (const detail::Value &i : h["images"].items())
            tick.images.push_back(image(i, reply.planes, frame));
        if (frame != reply.planes.size()) throw BadReply("a reply brings more than it announces");
        last_sequence_ = tick.sequence;
        return tick;
    }

    static Image image(const detail::Value &i, const std::vector<detail::Frame> &frames,
                       std::size_t &frame) {
        const auto &rows = i["intrinsics"].items();
        if (rows.size() != 3) throw BadReply("intrinsics of a reply are no 3 x 3 matrix");
        Image image{i["camera"].text(), i["position_m"].reals<3>(),
                    i["q_camera_from_icrf_xyzw"].reals<4>(),
                    {rows[0].reals<3>(), rows[1].reals<3>(), rows[2].reals<3>()},
                    i["exposure_time_s"].real(), i["gain_dn_per_e"].real(),
                    i["exposure_start_tai_ns"].whole(), i["exposure_end_tai_ns"].whole(),
                    i["readout_end_tai_ns"].whole(), i["available_tai_ns"].whole(),
                    i["sun_direction_icrf"].reals<3>(), i["sun_irradiance_w_m2"].reals<4>(),
                    {}, {}};
        if (!i["saturated_pixels"].is_nil()) image.saturated_pixels = i["saturated_pixels"].whole();
        for (const detail::Value &p : i["planes"].items()) {
            if (frame == frames.size()) throw BadReply("a reply announces more than it brings");
            Plane plane;
            plane.product = p["product"].text();
            plane.dtype = p["dtype"].text();
            plane.unit = p["unit"].text();
            plane.frame_ = frames[frame++];
            std::size_t bytes = plane.dtype == "<u2" ? 2 : 4;
            for (const detail::Value &n : p["shape"].items()) {
                plane.shape.push_back(static_cast<std::size_t>(n.natural()));
                if (plane.shape.back() < 1 || plane.shape.back() > 65536)
                    throw BadReply("a plane of a reply has no possible shape");
                bytes *= plane.shape.back();
            }
            if (bytes != plane.size())
                throw BadReply("plane \"" + plane.product + "\" announces " +
                               std::to_string(bytes) + " bytes and brings " +
                               std::to_string(plane.size()));
            image.planes.push_back(std::move(plane));
        }
        return image;
    }

    static Clock::time_point after(Clock::time_point start, double seconds) {
        return start + std::chrono::duration_cast<Clock::duration>(
                           std::chrono::duration<double>(seconds));
    }

    // With options the server may be starting: it is pinged, and given up once it says nothing for
    // timeout_s, or is not ready in time.
    Reply ask(const std::string &header, const char *kind, std::uint64_t id, const char *asked,
              const Options *starting = nullptr) {
        const auto start = Clock::now();
        const auto deadline = after(start, starting ? starting->ready_timeout_s : timeout_s_);
        auto heard = start, ping = start;
        settle();
        send(header);
        for (;;) {
            auto wake = deadline;
            if (starting) wake = std::min({deadline, after(heard, timeout_s_), after(ping, 1.0)});
            // The connection broke before this request; within it that ends the wait at once.
            if (is_lost()) wake = std::min(wake, after(start, reconnect_timeout_s_));
            const bool broke = wait(wake);
            Reply reply;
            while (receive(reply)) {
                heard = Clock::now();
                const std::string &type = reply.header["type"].text();
                if (type == "bye") throw no_answer("the server said goodbye", asked);
                if (starting) show_status(reply.header, *starting);
                const detail::Value none, &its = reply.header.has("id") ? reply.header["id"] : none;
                const bool mine = its.is_nil() || its.natural() == id;
                if (type == "error" && mine) throw refused(reply.header);
                if (type == kind && mine) return reply;
            }
            if (broke) throw no_answer("the connection broke", asked);
            const auto now = Clock::now();
            if (starting && now >= deadline)
                throw no_answer(within("not done", starting->ready_timeout_s), asked);
            if (is_lost() && now >= after(start, reconnect_timeout_s_))
                throw no_answer(within("no connection", reconnect_timeout_s_), asked);
            if (now >= deadline || (starting && now >= after(heard, timeout_s_)))
                throw no_answer(within(connected_ ? "no answer" : "no connection", timeout_s_), asked);
            if (starting && now >= after(ping, 1.0)) {
                ping = now;
                detail::Writer w;
                w.map(2).text("type").text("ping").text("id").natural(0);
                if (connected_) send(w.bytes);
            }
        }
    }

    static void show_status(const detail::Value &header, const Options &options) {
        if (!options.on_status || !header.has("status") || header["status"].is_nil()) return;
        const detail::Value &s = header["status"];
        options.on_status({s["state"].text(), s["detail"].text(), s["done"].whole(),
                           s["total"].whole()});
    }

    bool is_lost() const { return let_in_ && !connected_; }

    // Receives what arrived since the last request; replies to abandoned requests are dropped.
    void settle() {
        Reply late;
        events();
        while (receive(late)) continue;
    }

    void send(const std::string &header) {
        // A full queue means that the server reads nothing; the call then ends at its timeout.
        if (zmq_send(socket_.get(), "simgl/1", 7, ZMQ_SNDMORE | ZMQ_DONTWAIT) == 7)
            zmq_send(socket_.get(), header.data(), header.size(), ZMQ_DONTWAIT);
    }

    // Whether the connection broke before a reply or the deadline came.
    bool wait(Clock::time_point deadline) {
        for (;;) {
            const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now());
            zmq_pollitem_t items[] = {{socket_.get(), 0, ZMQ_POLLIN, 0},
                                      {monitor_.get(), 0, ZMQ_POLLIN, 0}};
            const auto ms = left.count() > 0 ? left.count() : 0;
            if (zmq_poll(items, 2, static_cast<long>(ms)) <= 0 && Clock::now() >= deadline)
                return false;
            const bool broke = items[1].revents && events();
            if (broke || items[0].revents) return broke;
        }
    }

    bool events() {
        bool broke = false;
        for (;;) {
            detail::Frame event, where;
            if (zmq_msg_recv(event.get(), monitor_.get(), ZMQ_DONTWAIT) < 0) return broke;
            zmq_msg_recv(where.get(), monitor_.get(), ZMQ_DONTWAIT);
            std::uint16_t number;
            std::memcpy(&number, event.data(), 2);
            // A server that ends during a handshake fails it without detail, as one that does not
            // accept the keys does: for a client that was admitted before, it is a break.
            const bool cut_off = number == ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL && let_in_;
            if ((number & failed_) && !cut_off)
                throw Error(address_ + ": the server refused this client: its key, or the "
                            "server's, is missing or wrong, or the client is not on the list");
            broke = broke || (number == ZMQ_EVENT_DISCONNECTED && connected_);
            connected_ = number == ZMQ_EVENT_HANDSHAKE_SUCCEEDED;
            let_in_ = let_in_ || connected_;
        }
    }

    bool receive(Reply &reply) {
        std::vector<detail::Frame> frames;
        int more = 1;
        while (more) {
            frames.emplace_back();
            if (zmq_msg_recv(frames.back().get(), socket_.get(), ZMQ_DONTWAIT) < 0) {
                if (frames.size() == 1) return false;
                throw BadReply("a reply ends in the middle");
            }
            more = zmq_msg_more(frames.back().get());
        }
        heard_ = Clock::now();
        if (frames.size() < 2 || frames[0].size() != 7 ||
            std::memcmp(frames[0].data(), "simgl/1", 7) != 0)
            throw BadReply(address_ + ": does not speak simgl/1");
        reply.header = detail::Value::decode(frames[1].data(), frames[1].size());
        reply.planes.assign(frames.begin() + 2, frames.end());
        return true;
    }

    static std::string within(const char *what, double seconds) {
        char line[64];
        std::snprintf(line, sizeof line, "%s within %g s", what, seconds);
        return line;
    }

    NoAnswer no_answer(const std::string &reason, const char *asked) const {
        std::string line = address_ + ": " + reason + ", waiting for " + asked + "; ";
        if (heard_) {
            char age[32];
            const std::chrono::duration<double> since = Clock::now() - *heard_;
            std::snprintf(age, sizeof age, "last heard %.3g s ago", since.count());
            line += age;
        } else {
            line += "never heard of it";
        }
        return NoAnswer(line + (last_sequence_ ? ", last image " + std::to_string(last_sequence_)
                                               : ", no image before"));
    }

    Refused refused(const detail::Value &h) const {
        const std::string &code = h["code"].text();
        return Refused(address_ + ": " + code + ": " + h["detail"].text(), code,
                       h["field"].text(), h["retryable"].boolean());
    }

    static constexpr int failed_ = ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL |
                                   ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL |
                                   ZMQ_EVENT_HANDSHAKE_FAILED_AUTH;

    std::string address_, boot_;
    double timeout_s_, reconnect_timeout_s_;
    bool retry_, connected_ = false, let_in_ = false;
    int restarts_ = 0;
    std::uint64_t last_id_ = 0, last_sequence_ = 0;
    std::optional<Clock::time_point> heard_;
    Welcome welcome_{};
    // Destroyed in reverse order: sockets before their context.
    std::unique_ptr<void, End> context_;
    std::unique_ptr<void, Close> monitor_, socket_;
};

} // namespace simgl

#endif
