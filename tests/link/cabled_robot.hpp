// A robot of two hosts, head and base, with networks of their own and cables between them.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/link/cables.hpp"
#include "tests/link/scene.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::test {

// Numbers of their addresses, and of their cables.
inline constexpr int kHead = 1;
inline constexpr int kBase = 2;

class Cable : public testing::Test {
 protected:
  void SetUp() override {
    if (const std::string why = why_no_networks(); !why.empty()) GTEST_SKIP() << why;
  }
};

// All of a robot, made once it is known that it can be.
struct CabledRobot {
  CabledRobot() {
    cables.connect(head_network, kHead);
    cables.connect(base_network, kBase);
  }
  [[nodiscard]] static std::vector<std::string> arguments() { return {"--interface", "eth0"}; }
  [[nodiscard]] Host head(const std::string& model) const {
    return host("head", model, head_network);
  }
  [[nodiscard]] Host base(const std::string& model) const {
    return host("base", model, base_network);
  }
  [[nodiscard]] Host host(const std::string& name, const std::string& model,
                          const NetworkNamespace& network) const {
    return {name, runtime, model, arguments(), network.enter()};
  }

  Switch cables;
  NetworkNamespace head_network;
  NetworkNamespace base_network;
  TemporaryDirectory runtime;
};

}  // namespace arbiter::test
