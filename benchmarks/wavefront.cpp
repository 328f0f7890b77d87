// The field of dissertation moves in C++: the loops of lampyris/kernels/heads.py and descent.py, line by line, to
// tell what the language costs. Built by benchmarks/native.py; no part of the product.
#include <cstdint>
#include <cstddef>

using std::int8_t;
using std::int32_t;
using std::int64_t;
using std::size_t;
using std::uint32_t;
using std::uint8_t;

namespace {

template <typename T>
void lay_out(const uint8_t* free, T* plan, size_t size, size_t width, size_t rows, T open, T shut) {
  const size_t inside = width - 2;
  for (size_t i = 0; i < size; ++i) plan[i] = shut;
  for (size_t y = 0; y < rows - 2; ++y)
    for (size_t x = 0; x < inside; ++x) plan[(y + 1) * width + 1 + x] = free[y * inside + x] ? open : shut;
}

}  // namespace

extern "C" {

// Costs; returns how many levels.
int64_t costs(const uint8_t* free, int32_t* cost, uint8_t* fresh, uint32_t* order, uint32_t* level_cost,
              uint32_t* level_end, size_t width, size_t rows, size_t goal, int64_t straight, int64_t diagonal,
              int32_t never) {
  lay_out<int32_t>(free, cost, width * rows, width, rows, never, -1);
  lay_out<uint8_t>(free, fresh, width * rows, width, rows, 1, 0);
  order[0] = static_cast<uint32_t>(goal);
  cost[goal] = 0;
  fresh[goal] = 0;
  size_t tail = 1, near = 0, far = 0;
  int64_t near_level = 0, far_level = 0, levels = 1;
  level_cost[0] = 0;
  level_end[0] = 1;
  auto touch = [&](size_t n) {
    order[tail] = static_cast<uint32_t>(n);
    tail += fresh[n];
    fresh[n] = 0;
  };
  while (far_level < levels) {
    const int64_t by_diagonal = static_cast<int64_t>(level_cost[far_level]) + diagonal;
    const int64_t by_straight =
        near_level < levels ? static_cast<int64_t>(level_cost[near_level]) + straight : by_diagonal + 1;
    const int64_t d = by_straight < by_diagonal ? by_straight : by_diagonal;
    const size_t begin = tail;
    if (by_diagonal == d) {
      const size_t end = level_end[far_level];
      for (size_t i = far; i < end; ++i) {
        const size_t up = order[i] - width, down = order[i] + width;
        touch(up - 1);
        touch(up + 1);
        touch(down - 1);
        touch(down + 1);
      }
      far = end;
      ++far_level;
    }
    if (by_straight == d) {
      const size_t end = level_end[near_level];
      for (size_t i = near; i < end; ++i) {
        const size_t p = order[i];
        touch(p - width);
        touch(p - 1);
        touch(p + 1);
        touch(p + width);
      }
      near = end;
      ++near_level;
    }
    if (tail > begin) {
      for (size_t i = begin; i < tail; ++i) {
        __builtin_prefetch(&cost[order[i + 24]], 1);
        cost[order[i]] = static_cast<int32_t>(d);
      }
      level_cost[levels] = static_cast<uint32_t>(d);
      level_end[levels] = static_cast<uint32_t>(tail);
      ++levels;
    }
  }
  return levels;
}

// Parents by the local rule.
void parents(int32_t* cost, int8_t* step, size_t w, size_t rows, int32_t straight, int32_t diagonal,
             int32_t limit) {
  for (size_t i = 0; i < w * rows; ++i) step[i] = -1;
  for (size_t y = 0; y + 2 < rows; ++y) {
    const size_t begin = y * w, end = begin + w - 2, below = 2 * w;
    for (size_t i = begin; i < end; ++i) {
      const int32_t c = cost[i + w + 1], near = c - straight, far = c - diagonal;
      int32_t k = cost[i + below + 1] == near ? 7 : -1;
      k = cost[i + 1] == near ? 6 : k;
      k = cost[i + w + 2] == near ? 5 : k;
      k = cost[i + w] == near ? 4 : k;
      k = cost[i + below + 2] == far ? 3 : k;
      k = cost[i + below] == far ? 2 : k;
      k = cost[i + 2] == far ? 1 : k;
      k = cost[i] == far ? 0 : k;
      step[i + w + 1] = static_cast<int8_t>((c <= limit) & (c > 0) ? k : -1);
    }
    for (size_t i = begin; i < begin + w; ++i) cost[i] = cost[i] <= limit ? cost[i] : -1;
  }
  for (size_t i = (rows - 2) * w; i < rows * w; ++i) cost[i] = cost[i] <= limit ? cost[i] : -1;
}

// Luciferin along parents.
void glow(const uint32_t* order, size_t size, size_t count, const int32_t* cost, const int8_t* step,
          const int64_t* jump, double* luciferin, double nothing, double keep, double gamma, double unit) {
  for (size_t i = 0; i < size; ++i) luciferin[i] = nothing;
  luciferin[order[0]] = 0.0;
  for (size_t i = 1; i < count; ++i) {
    __builtin_prefetch(&luciferin[order[i + 24]], 1);
    const size_t n = order[i];
    luciferin[n] = keep * luciferin[n + jump[step[n]]] + gamma * (cost[n] / unit);
  }
}

// The least that any program must do: write every result once.
void floor_of_memory(int32_t* cost, int8_t* step, double* luciferin, size_t size) {
  for (size_t i = 0; i < size; ++i) cost[i] = 1;
  for (size_t i = 0; i < size; ++i) step[i] = 1;
  for (size_t i = 0; i < size; ++i) luciferin[i] = 1.0;
}
}
