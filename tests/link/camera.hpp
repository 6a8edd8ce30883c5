// A camera on one host, whose images a view on another host shows, but for a pause.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include <arbiter/arbiter.hpp>

#include "tests/link/scene.hpp"

namespace arbiter::test {

inline constexpr const char* kCamera = "/Camera/image:o";
inline constexpr const char* kPause = "/Pause/image:o";
inline constexpr const char* kView = "/View/image:i";

struct Image {
  std::int64_t number;
  std::array<std::byte, 40'000> pixels;
};

// The view shows the camera, but for a pause.
inline std::string view_model(const std::string& timeout) {
  return "<behaviors timeout='" + timeout + R"('>
    <source port="/Pause/image:o" timeout="forever"/>
    <behavior name="Watch"><config at="/View/image:i">/Camera/image:o</config></behavior>
    <behavior name="Pause"><config at="/View/image:i">/Pause/image:o</config>
      <inhibition>Watch</inhibition></behavior>
  </behaviors>)";
}

class Camera {
 public:
  explicit Camera(const Host& host)
      : node_(host.node("eye")), port_(node_.output_port<Image>(kCamera)) {}
  std::int64_t publish() {
    auto image = port_.loan();
    (*image)->number = ++published_;
    port_.publish(std::move(*image));
    return published_;
  }
  OutputPort<Image>& port() { return port_; }
  [[nodiscard]] std::int64_t published() const { return published_; }

 private:
  Node node_;
  OutputPort<Image> port_;
  std::int64_t published_ = 0;
};

class View {
 public:
  explicit View(const Host& host)
      : node_(host.node("view")),
        pause_(node_.output_port<Image>(kPause)),
        in_(node_.input_port<Image>(kView)) {}
  // The camera publishes until its image is seen.
  void watch(Camera& camera) {
    await([&] {
      camera.publish();
      return seen(5ms).has_value();
    });
  }
  // The number of the camera's next image.
  std::optional<std::int64_t> seen(std::chrono::milliseconds within) {
    const auto got = in_.wait_for(within);
    if (!got || got->source() != kCamera) return std::nullopt;
    EXPECT_GT((*got)->number, last_) << "in order, and none twice";
    last_ = (*got)->number;
    return last_;
  }
  // What waits is dropped.
  void pause() {
    pause_.signal();
    EXPECT_FALSE(in_.take());
  }
  void go_on() { pause_.deactivate(); }
  InputPort<Image>& in() { return in_; }
  [[nodiscard]] Node& node() { return node_; }

 private:
  Node node_;
  OutputPort<Image> pause_;
  InputPort<Image> in_;
  std::int64_t last_ = 0;
};

// 412 in "412 withheld"; 0: it says nothing of it.
inline int withheld_at(Host& host) {
  const std::string described = host.described(kCamera);
  const std::size_t end = described.find(" withheld");
  if (end == std::string::npos) return 0;
  return std::stoi(described.substr(described.rfind(' ', end - 1) + 1));
}

// Publishes until samples stay at home.
inline void lose(Host& base, Camera& camera) {
  const int before = withheld_at(base);
  await([&] {
    camera.publish();
    return withheld_at(base) > before;
  });
}

}  // namespace arbiter::test
