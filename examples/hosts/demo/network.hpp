// Two hosts' networks and the cable between them. Nothing is left behind: the networks are
// namespaces that live as long as descriptors of this process, and the cable goes with them.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace hosts_demo {

inline constexpr std::size_t kHead = 0, kBody = 1, kHosts = 2;
inline constexpr std::array<const char*, kHosts> kHostNames{"head", "body"};

class Network {
 public:
  // Before this process has a second thread. Somebody else than root becomes root of a user
  // namespace, which is all that it takes, where the machine allows that.
  explicit Network(bool is_wanted);
  ~Network();
  Network(const Network&) = delete;
  Network& operator=(const Network&) = delete;

  // Empty: there are two networks and a cable. Else why there are not.
  [[nodiscard]] const std::string& obstacle() const { return obstacle_; }
  // What a program of a host is started by.
  [[nodiscard]] std::vector<std::string> enter(std::size_t host) const;
  void pull() const;
  void put_back() const;

 private:
  void make();
  // On a thread that is in the host's network.
  void inside(std::size_t host, const std::function<void()>& work) const;

  std::array<int, kHosts> namespaces_{-1, -1};
  std::string obstacle_;
};

}  // namespace hosts_demo
