// The field in C++: the loops of lampyris/kernels/heads.py, wavefront.py and descent.py, line by line but for
// the early stop, to tell what the language costs. Built by benchmarks/native.py; no part of the product.
//
// Arrays do not overlap, and where that helps the compiler it is told so. Costs are of 32 bits, or of 64 where
// octile moves need them: such functions come twice.
#include <cstddef>
#include <cstdint>

using std::int32_t;
using std::int64_t;
using std::int8_t;
using std::size_t;
using std::uint32_t;
using std::uint8_t;

namespace {

template <typename T>
void lay_out(const uint8_t* __restrict free, T* __restrict plan, size_t cells, size_t size, size_t width,
             size_t pad, T open, T shut) {
  const size_t inside = width - 2 * pad, seam = 2 * pad;
  size_t at = width * pad + pad;
  for (size_t i = 0; i < at; ++i) plan[i] = shut;
  for (size_t row = 0; row < cells; row += inside) {
    for (size_t x = 0; x < inside; ++x) plan[at + x] = free[row + x] ? open : shut;
    at += inside;
    for (size_t x = 0; x < seam; ++x) plan[at + x] = shut;
    at += seam;
  }
  for (size_t i = at; i < size; ++i) plan[i] = shut;
}

// A level is whole: its cells get its cost.
inline void settle(const uint32_t* order, int32_t* cost, size_t begin, size_t tail, int64_t d) {
  for (size_t i = begin; i < tail; ++i) {
    __builtin_prefetch(&cost[order[i + 24]], 1);
    cost[order[i]] = static_cast<int32_t>(d);
  }
}

inline int64_t least(int64_t a, int64_t b) { return a < b ? a : b; }

template <typename T>
int64_t windows(const uint8_t* free, T* cost, uint32_t* order, size_t cells, size_t size, size_t w, size_t goal,
                T straight, T diagonal, T guard, T never) {
  lay_out<T>(free, cost, cells, size, w, 1, never, -1);
  const size_t late = cells + 1;
  size_t waiting = late, head = 0, end = 1, tail = 1;
  T hi = straight;
  cost[goal] = 0;
  order[0] = static_cast<uint32_t>(goal);
  while (head < end || waiting > late) {
    const T hi_next = hi + straight;
    for (size_t i = late; i < waiting; ++i) {
      order[tail] = order[i];
      tail += cost[order[i]] >= hi;
    }
    waiting = late;
    while (head < end) {
      const size_t far = order[head + 24];
      __builtin_prefetch(&cost[far - w], 1);
      __builtin_prefetch(&cost[far + w], 1);
      __builtin_prefetch(&cost[far - 1], 1);
      __builtin_prefetch(&cost[far + 1], 1);
      const size_t p = order[head++], up = p - w, left = p - 1, right = p + 1, down = p + w;
      const T d = cost[p];
      T c = d + straight;
      auto enter = [&](size_t n) {
        const T old = cost[n];
        order[tail] = static_cast<uint32_t>(n);
        tail += old >= hi_next;
        cost[n] = old < c ? old : c;
        return old;
      };
      const T old_up = enter(up), old_left = enter(left), old_right = enter(right), old_down = enter(down);
      c = d + diagonal;
      const bool soon = c < hi_next;
      size_t t = soon ? tail : waiting;
      const T bar = soon ? hi_next : hi_next + straight;
      auto cross = [&](size_t n, T sides) {
        const T old = cost[n];
        const T seen = (old | (sides & guard)) < 0 ? static_cast<T>(-1) : old;
        order[t] = static_cast<uint32_t>(n);
        t += seen >= bar;
        cost[n] = seen < c ? old : c;
      };
      cross(up - 1, old_up | old_left);
      cross(up + 1, old_up | old_right);
      cross(down - 1, old_down | old_left);
      cross(down + 1, old_down | old_right);
      tail = soon ? t : tail;
      waiting = soon ? waiting : t;
    }
    end = tail;
    hi = hi_next;
  }
  return static_cast<int64_t>(head);
}

template <typename T>
void parents8(T* __restrict cost, int8_t* __restrict step, size_t w, size_t rows, T straight, T diagonal,
              T guard, T limit) {
  for (size_t i = 0; i < w * rows; ++i) step[i] = -1;
  for (size_t y = 0; y + 2 < rows; ++y) {
    const size_t begin = y * w, end = begin + w - 2, below = 2 * w;
    if (guard == 0) {
      for (size_t i = begin; i < end; ++i) {
        const T c = cost[i + w + 1], near = c - straight, far = c - diagonal;
        T k = cost[i + below + 1] == near ? 7 : -1;
        k = cost[i + 1] == near ? 6 : k;
        k = cost[i + w + 2] == near ? 5 : k;
        k = cost[i + w] == near ? 4 : k;
        k = cost[i + below + 2] == far ? 3 : k;
        k = cost[i + below] == far ? 2 : k;
        k = cost[i + 2] == far ? 1 : k;
        k = cost[i] == far ? 0 : k;
        step[i + w + 1] = static_cast<int8_t>((c <= limit) & (c > 0) ? k : -1);
      }
    } else {
      for (size_t i = begin; i < end; ++i) {
        const T c = cost[i + w + 1], near = c - straight, far = c - diagonal;
        const T up = cost[i + 1], left = cost[i + w], right = cost[i + w + 2], down = cost[i + below + 1];
        T k = down == near ? 7 : -1;
        k = up == near ? 6 : k;
        k = right == near ? 5 : k;
        k = left == near ? 4 : k;
        k = (cost[i + below + 2] == far) & ((down | right) >= 0) ? 3 : k;
        k = (cost[i + below] == far) & ((down | left) >= 0) ? 2 : k;
        k = (cost[i + 2] == far) & ((up | right) >= 0) ? 1 : k;
        k = (cost[i] == far) & ((up | left) >= 0) ? 0 : k;
        step[i + w + 1] = static_cast<int8_t>((c <= limit) & (c > 0) ? k : -1);
      }
    }
    for (size_t i = begin; i < begin + w; ++i) cost[i] = cost[i] <= limit ? cost[i] : -1;
  }
  for (size_t i = (rows - 2) * w; i < rows * w; ++i) cost[i] = cost[i] <= limit ? cost[i] : -1;
}

template <typename T>
void glow(const uint32_t* order, size_t size, size_t count, const T* cost, const int8_t* step,
          const int64_t* jump, double* __restrict luciferin, double nothing, double keep, double gamma,
          double unit) {
  for (size_t i = 0; i < size; ++i) luciferin[i] = nothing;
  luciferin[order[0]] = 0.0;
  for (size_t i = 1; i < count; ++i) {
    __builtin_prefetch(&luciferin[order[i + 24]], 1);
    const size_t n = order[i];
    luciferin[n] = keep * luciferin[n + jump[step[n]]] + gamma * (cost[n] / unit);
  }
}

// Luciferin of one cell whose parent has none yet: up to the first that has, and down again.
template <typename T>
void climb(const T* cost, const int8_t* step, const int64_t* jump, double* luciferin, size_t p, double keep,
           double gamma, double unit) {
  double came = -2.0;
  while (luciferin[p] < 0.0) {
    luciferin[p] = came;
    came = -3.0 - static_cast<double>(p);
    p += jump[step[p]];
  }
  double above = luciferin[p];
  while (came < -2.0) {
    p = static_cast<size_t>(-3.0 - came);
    came = luciferin[p];
    above = keep * above + gamma * (cost[p] / unit);
    luciferin[p] = above;
  }
}

// Luciferin row by row, for maps that no cache holds.
template <typename T>
void shine(const T* cost, const int8_t* step, const int64_t* jump, double* luciferin, size_t size, size_t w,
           size_t goal, double nothing, double keep, double gamma, double unit) {
  const size_t rows = size / w, middle = goal / w, across = goal - middle * w;
  for (size_t i = 0; i < size; ++i) luciferin[i] = cost[i] < 0 ? nothing : -1.0;
  luciferin[goal] = 0.0;
  auto look = [&](size_t i) {
    const double own = luciferin[i], above = luciferin[i + jump[step[i] & 127]];
    const double found = keep * above + gamma * (cost[i] / unit);
    luciferin[i] = (own < 0.0) & (above >= 0.0) ? found : own;
  };
  for (size_t k = 0; k < rows; ++k) {
    const size_t row = (middle + k < rows ? middle + k : rows - 1 - k) * w;
    for (size_t i = row + across; i < row + w; ++i) look(i);
    for (size_t j = 0; j < across; ++j) look(row + across - 1 - j);
    for (size_t i = row; i < row + w; ++i)
      if (luciferin[i] < 0.0) climb(cost, step, jump, luciferin, i, keep, gamma, unit);
  }
}

}  // namespace

extern "C" {

// Costs by levels; each returns how many.
int64_t one_head(const uint8_t* free, int32_t* cost, uint8_t* fresh, uint32_t* order, uint32_t* level_cost,
                 uint32_t* level_end, size_t cells, size_t size, size_t w, size_t goal, int64_t straight,
                 int64_t never) {
  lay_out<int32_t>(free, cost, cells, size, w, 1, static_cast<int32_t>(never), -1);
  lay_out<uint8_t>(free, fresh, cells, size, w, 1, 1, 0);
  order[0] = static_cast<uint32_t>(goal);
  cost[goal] = 0;
  fresh[goal] = 0;
  size_t tail = 1, head = 0;
  int64_t levels = 1, d = 0;
  level_cost[0] = 0;
  level_end[0] = 1;
  auto touch = [&](size_t n) {
    order[tail] = static_cast<uint32_t>(n);
    tail += fresh[n];
    fresh[n] = 0;
  };
  while (head < tail) {
    const size_t begin = tail;
    d += straight;
    for (size_t i = head; i < begin; ++i) {
      const size_t p = order[i];
      touch(p - w);
      touch(p - 1);
      touch(p + 1);
      touch(p + w);
    }
    head = begin;
    if (tail > begin) {
      settle(order, cost, begin, tail, d);
      level_cost[levels] = static_cast<uint32_t>(d);
      level_end[levels] = static_cast<uint32_t>(tail);
      ++levels;
    }
  }
  return levels;
}

int64_t two_heads(const uint8_t* free, int32_t* cost, uint8_t* fresh, uint32_t* order, uint32_t* level_cost,
                  uint32_t* level_end, size_t cells, size_t size, size_t w, size_t goal, int64_t straight,
                  int64_t diagonal, int64_t never) {
  lay_out<int32_t>(free, cost, cells, size, w, 1, static_cast<int32_t>(never), -1);
  lay_out<uint8_t>(free, fresh, cells, size, w, 1, 1, 0);
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
    const int64_t d = least(by_straight, by_diagonal);
    const size_t begin = tail;
    if (by_diagonal == d) {
      const size_t end = level_end[far_level];
      for (size_t i = far; i < end; ++i) {
        const size_t up = order[i] - w, down = order[i] + w;
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
        touch(p - w);
        touch(p - 1);
        touch(p + 1);
        touch(p + w);
      }
      near = end;
      ++near_level;
    }
    if (tail > begin) {
      settle(order, cost, begin, tail, d);
      level_cost[levels] = static_cast<uint32_t>(d);
      level_end[levels] = static_cast<uint32_t>(tail);
      ++levels;
    }
  }
  return levels;
}

int64_t three_heads(const uint8_t* free, int32_t* cost, uint8_t* fresh, uint32_t* order, uint32_t* level_cost,
                    uint32_t* level_end, size_t cells, size_t size, size_t w, size_t goal, int64_t straight,
                    int64_t diagonal, int64_t knight, int64_t never) {
  lay_out<int32_t>(free, cost, cells, size, w, 2, static_cast<int32_t>(never), -1);
  lay_out<uint8_t>(free, fresh, cells, size, w, 2, 3, 0);
  order[0] = static_cast<uint32_t>(goal);
  cost[goal] = 0;
  fresh[goal] = 2;
  size_t tail = 1, near = 0, far = 0, leap = 0;
  int64_t near_level = 0, far_level = 0, leap_level = 0, levels = 1;
  level_cost[0] = 0;
  level_end[0] = 1;
  auto touch = [&](size_t n, int passed) {
    order[tail] = static_cast<uint32_t>(n);
    const uint8_t ok = static_cast<uint8_t>(passed & fresh[n] & 1);
    tail += ok;
    fresh[n] = static_cast<uint8_t>(fresh[n] - ok);
  };
  while (leap_level < levels) {
    const int64_t by_knight = static_cast<int64_t>(level_cost[leap_level]) + knight;
    const int64_t by_diagonal =
        far_level < levels ? static_cast<int64_t>(level_cost[far_level]) + diagonal : by_knight + 1;
    const int64_t by_straight =
        near_level < levels ? static_cast<int64_t>(level_cost[near_level]) + straight : by_knight + 1;
    const int64_t d = least(least(by_straight, by_diagonal), by_knight);
    const size_t begin = tail;
    if (by_knight == d) {
      const size_t end = level_end[leap_level];
      for (size_t i = leap; i < end; ++i) {
        const size_t p = order[i], up = p - w, down = p + w;
        const int north = fresh[up] >> 1, south = fresh[down] >> 1, west = fresh[p - 1] >> 1;
        const int east = fresh[p + 1] >> 1, nw = fresh[up - 1] >> 1, ne = fresh[up + 1] >> 1;
        const int sw = fresh[down - 1] >> 1, se = fresh[down + 1] >> 1;
        touch(up - 2, west & nw);
        touch(up + 2, east & ne);
        touch(down - 2, west & sw);
        touch(down + 2, east & se);
        touch(up - w - 1, north & nw);
        touch(up - w + 1, north & ne);
        touch(down + w - 1, south & sw);
        touch(down + w + 1, south & se);
      }
      leap = end;
      ++leap_level;
    }
    if (by_diagonal == d) {
      const size_t end = level_end[far_level];
      for (size_t i = far; i < end; ++i) {
        const size_t p = order[i], up = p - w, down = p + w;
        const int north = fresh[up] >> 1, south = fresh[down] >> 1;
        const int west = fresh[p - 1] >> 1, east = fresh[p + 1] >> 1;
        touch(up - 1, north & west);
        touch(up + 1, north & east);
        touch(down - 1, south & west);
        touch(down + 1, south & east);
      }
      far = end;
      ++far_level;
    }
    if (by_straight == d) {
      const size_t end = level_end[near_level];
      for (size_t i = near; i < end; ++i) {
        const size_t p = order[i];
        touch(p - w, 1);
        touch(p - 1, 1);
        touch(p + 1, 1);
        touch(p + w, 1);
      }
      near = end;
      ++near_level;
    }
    if (tail > begin) {
      settle(order, cost, begin, tail, d);
      level_cost[levels] = static_cast<uint32_t>(d);
      level_end[levels] = static_cast<uint32_t>(tail);
      ++levels;
    }
  }
  return levels;
}

// Costs by windows; returns how many cells settled.
int64_t windows_64(const uint8_t* free, int64_t* cost, uint32_t* order, size_t cells, size_t size, size_t w,
                   size_t goal, int64_t straight, int64_t diagonal, int64_t guard, int64_t never) {
  return windows<int64_t>(free, cost, order, cells, size, w, goal, straight, diagonal, guard, never);
}

// Parents by the local rule: eight moves, and any (costs of 32 bits).
void parents8_32(int32_t* cost, int8_t* step, size_t w, size_t rows, int64_t straight, int64_t diagonal,
                 int64_t guard, int64_t limit) {
  parents8<int32_t>(cost, step, w, rows, static_cast<int32_t>(straight), static_cast<int32_t>(diagonal),
                    static_cast<int32_t>(guard), static_cast<int32_t>(limit));
}

void parents8_64(int64_t* cost, int8_t* step, size_t w, size_t rows, int64_t straight, int64_t diagonal,
                 int64_t guard, int64_t limit) {
  parents8<int64_t>(cost, step, w, rows, straight, diagonal, guard, limit);
}

void parents(int32_t* __restrict cost, int8_t* __restrict step, size_t w, size_t rows, size_t pad,
             const int64_t* jump, const int64_t* side, const int64_t* other, const int32_t* price, size_t steps,
             int64_t most) {
  const int32_t limit = static_cast<int32_t>(most);
  for (size_t i = 0; i < w * rows; ++i) step[i] = -1;
  for (size_t y = pad; y < rows - pad; ++y) {
    const size_t begin = y * w + pad, end = begin + w - 2 * pad;
    for (size_t k = steps; k-- > 0;) {
      const int64_t ahead = jump[k], first = side[k], second = other[k];
      const int32_t toll = price[k];
      for (size_t at = begin; at < end; ++at) {
        const int32_t c = cost[at], here = cost[at + ahead];
        const bool hit =
            (here == c - toll) & ((here | cost[at + first] | cost[at + second]) >= 0) & (c <= limit);
        step[at] = hit ? static_cast<int8_t>(k) : step[at];
      }
    }
  }
  for (size_t i = 0; i < w * rows; ++i) cost[i] = cost[i] <= limit ? cost[i] : -1;
}

// Luciferin along parents.
void glow_32(const uint32_t* order, size_t size, size_t count, const int32_t* cost, const int8_t* step,
             const int64_t* jump, double* luciferin, double nothing, double keep, double gamma, double unit) {
  glow<int32_t>(order, size, count, cost, step, jump, luciferin, nothing, keep, gamma, unit);
}

void glow_64(const uint32_t* order, size_t size, size_t count, const int64_t* cost, const int8_t* step,
             const int64_t* jump, double* luciferin, double nothing, double keep, double gamma, double unit) {
  glow<int64_t>(order, size, count, cost, step, jump, luciferin, nothing, keep, gamma, unit);
}

void shine_32(const int32_t* cost, const int8_t* step, const int64_t* jump, double* luciferin, size_t size,
              size_t w, size_t goal, double nothing, double keep, double gamma, double unit) {
  shine<int32_t>(cost, step, jump, luciferin, size, w, goal, nothing, keep, gamma, unit);
}

void shine_64(const int64_t* cost, const int8_t* step, const int64_t* jump, double* luciferin, size_t size,
              size_t w, size_t goal, double nothing, double keep, double gamma, double unit) {
  shine<int64_t>(cost, step, jump, luciferin, size, w, goal, nothing, keep, gamma, unit);
}
}
