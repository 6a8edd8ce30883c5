// Cyclone's handles, deleted with their owner; and its errors as exceptions.
#pragma once

#include <dds/dds.h>

#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

namespace arbiter::gateway::dds {

class DdsError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class Entity {
 public:
  Entity() = default;
  // Throws DdsError: "WHAT: Cyclone's reason", where `entity` is an error.
  Entity(dds_entity_t entity, const std::string& what) : entity_(entity) {
    if (entity < 0) throw DdsError(what + ": " + dds_strretcode(-entity));
  }
  Entity(Entity&& other) noexcept : entity_(std::exchange(other.entity_, 0)) {}
  Entity& operator=(Entity&& other) noexcept {
    std::swap(entity_, other.entity_);
    return *this;
  }
  Entity(const Entity&) = delete;
  Entity& operator=(const Entity&) = delete;
  // Waits for calls of its listeners that are under way.
  ~Entity() {
    if (entity_ > 0) dds_delete(entity_);
  }

  [[nodiscard]] dds_entity_t get() const { return entity_; }
  explicit operator bool() const { return entity_ > 0; }

 private:
  dds_entity_t entity_ = 0;
};

struct DeleteQos {
  void operator()(dds_qos_t* qos) const { dds_delete_qos(qos); }
};
using CycloneQos = std::unique_ptr<dds_qos_t, DeleteQos>;

struct DeleteListener {
  void operator()(dds_listener_t* listener) const { dds_delete_listener(listener); }
};
using Listener = std::unique_ptr<dds_listener_t, DeleteListener>;

}  // namespace arbiter::gateway::dds
