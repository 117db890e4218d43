"""Friction, mostly in closed form: partial slip and twist, slip hardening of one point, wedge, circular path, capstan, die, laws.

Sign convention of this module: a traction is positive along the drag, that is, along positive displacement of the body.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ._check import Array, not_negative, positive

# --- partial slip -----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class CattaneoMindlin:
    """Line contact under P, loaded tangentially to Q_max and now at Q: half-widths (length), p0 (stress), traction(x).

    a: contact; c: stick at Q_max; c_reversed: inner edge of the reversed slip (equal to a while loading). P, Q, Q_max
    are forces/length.
    """

    a: float
    c: float
    c_reversed: float
    P: float
    Q: float
    Q_max: float
    mu: float
    p0: float

    def traction(self, x: ArrayLike) -> Array:
        """x: any shape (length, from the centre) -> same shape (stress): tangential traction, of the sign of Q_max."""
        x = np.asarray(x, dtype=float)
        q = self._elliptic(x, self.a) - self._elliptic(x, self.c)
        return np.asarray(q - 2.0 * (self._elliptic(x, self.a) - self._elliptic(x, self.c_reversed)))

    def _elliptic(self, x: Array, half_width: float) -> Array:
        """`mu` p0 (half_width/a) sqrt(1 - x^2/half_width^2), written so that half_width may be 0."""
        root = np.sqrt(np.clip(half_width * half_width - x * x, 0.0, None))
        return np.asarray(self.mu * self.p0 / self.a * root)


def cattaneo_mindlin(*, P: float, a: float, mu: float, Q: float, Q_max: float | None = None) -> CattaneoMindlin:
    """P, Q, Q_max (force/length), a (length), mu (-) -> CattaneoMindlin: a cylinder pressed, then pushed sideways.

    P is constant; Q grows from zero to Q_max (None: Q is the largest so far) and comes back to Q. Loading: stick
    within c = a sqrt(1 - Q_max/(mu P)), q = mu p - mu p0 (c/a) sqrt(1 - x^2/c^2) there, mu p outside. Unloading:
    reversed slip outside c' = a sqrt(1 - (Q_max - Q)/(2 mu P)), q reduced by twice the loading form with c'. The
    pressure is Hertz's, p0 = 2 P/(pi a): exact when normal and tangential problems decouple (equal bodies, nu = 1/2
    on a rigid one), close when friction acts only after pressing.

    Raises ValueError for P, a or mu not above 0, a Q_max outside [0, mu P) or a Q outside [-Q_max, Q_max].
    Source: Cattaneo (1938), Mindlin (1949), Mindlin & Deresiewicz (1953); Johnson (1985), Contact Mechanics, ch. 7.
    """
    positive(P=P, a=a, mu=mu)
    largest = Q if Q_max is None else Q_max
    if not 0.0 <= largest < mu * P:
        name = "Q" if Q_max is None else "Q_max"
        raise ValueError(f"{name} = {largest!r}: partial slip needs 0 <= {name} < mu P = {mu * P!r}; lower {name}")
    if abs(Q) > largest:
        raise ValueError(f"Q = {Q!r}: beyond Q_max = {largest!r}; give -Q_max <= Q <= Q_max")
    return CattaneoMindlin(
        a=a,
        c=a * math.sqrt(1.0 - largest / (mu * P)),
        c_reversed=a * math.sqrt(1.0 - (largest - Q) / (2.0 * mu * P)),
        P=P,
        Q=Q,
        Q_max=largest,
        mu=mu,
        p0=2.0 * P / (math.pi * a),
    )


@dataclass(frozen=True)
class PartialTwist:
    """Spherical contact under P, twisted about its normal: radii a of the contact and c of the stick (length), twist, moment.

    twist: of the sphere about its axis against the body far away (rad). P, moment: force, force length.
    """

    a: float
    c: float
    P: float
    twist: float
    moment: float


def lubkin_torsion(*, P: float, a: float, mu: float, G: float, c: float) -> PartialTwist:
    """P (force), a, c (length), mu (-), G (stress) -> PartialTwist: a sphere pressed, then twisted until it sticks within c.

    The pressure is Hertz's, p0 = 3 P/(2 pi a^2); G is the shear modulus of the half-space under a rigid sphere, of two bodies
    1/G = 1/G1 + 1/G2. Torsion displaces along circles only: nothing couples with the pressure. With
    phi(t) = (2 mu p0/(pi G)) t (K(k) - E(k)), k^2 = 1 - t^2/a^2, in the slip c < t < a and phi = 4 twist t/pi within c, where
    it is continuous, the moment is 4 pi G times the integral of t phi over 0 < t < a: 16 G a^3 twist/3 without slip,
    3 pi mu P a/16 when all of it slips.

    Raises ValueError for P, a, mu, G not above 0 or c outside (0, a].
    Source: Lubkin (1951), J. Appl. Mech. 18, 183; Deresiewicz (1954), J. Appl. Mech. 21, 52; Johnson (1985), ch. 7.
    """
    positive(P=P, a=a, mu=mu, G=G, c=c)
    if c > a:
        raise ValueError(f"c = {c!r}: the stick lies within the contact; give 0 < c <= a = {a!r}")

    from scipy.integrate import quad
    from scipy.special import ellipe, ellipkm1

    def slope(t: float) -> float:
        """Of phi over t, in the slip."""
        m1 = (t / a) ** 2  # 1 - k^2: near the edge K and E differ by little, near the middle K is large
        return float(3.0 * mu * P / (math.pi**2 * a * a * G) * (ellipkm1(m1) - ellipe(1.0 - m1)))

    twist = 0.25 * math.pi * slope(c)
    slip = quad(lambda t: t * t * slope(t), c, a, epsabs=0.0, epsrel=1e-10)[0] if c < a else 0.0
    return PartialTwist(a=a, c=c, P=P, twist=twist, moment=4.0 * math.pi * G * (slope(c) * c**3 / 3.0 + slip))


def flat_punch_stick(mu: float, nu: float, n: int = 300) -> float:
    """`mu` (-), `nu` (-) -> half-width of the stick zone over that of a rigid flat punch pressed on a half-plane.

    Plane strain, sharp edges, friction from the first touch on; the load is proportional, so the zone does not move.
    With beta = (1 - 2 nu)/(2 (1 - nu)), p the pressure and q the outward traction over the total force, 0 < x < 1,

        1/pi int p ln|x - s| ds - beta int_0^x q ds = const,    beta int_0^x p ds + 1/pi int q ln|x - s| ds = 0 where it
        sticks,    q = mu p where it slides,

    by piecewise constants on `n` cells, dense at the edge; the edge of stick is where (1 - q/(mu p))^2 vanishes, which it
    does linearly. Good to 1e-3. Without the term of q in the first equation it obeys K'(c)/K(c) = beta/mu.

    Raises ValueError for mu or n not above 0 or nu outside [0, 0.5).
    Source: Johnson (1985), Contact Mechanics, eq. (2.25); Spence (1973), Proc. Camb. Phil. Soc. 73, 249-268.
    """
    positive(mu=mu, n=n)
    if not 0.0 <= nu < 0.5:
        raise ValueError(f"nu = {nu!r}: at 0.5 and above nothing slides; give 0 <= nu < 0.5")
    beta = (1.0 - 2.0 * nu) / (2.0 * (1.0 - nu))
    ends = np.sin(0.5 * np.pi * np.linspace(0.0, 1.0, n + 1))
    a, b = ends[:-1], ends[1:]
    x, h = 0.5 * (a + b), b - a

    def integral(y: Array) -> Array:
        return np.asarray(y * np.log(np.abs(y)) - y)

    here = integral(x[:, None] - a) - integral(x[:, None] - b)
    mirrored = integral(x[:, None] + b) - integral(x[:, None] + a)
    up_to = np.tril(np.ones((n, n)), -1) * h + np.diag(0.5 * h)
    A = np.zeros((2 * n + 1, 2 * n + 1))
    A[:n, :n], A[:n, n:-1], A[:n, -1] = (here + mirrored) / np.pi, -beta * up_to, 1.0
    A[n:-1, :n], A[n:-1, n:-1] = beta * up_to, (here - mirrored) / np.pi
    A[-1, :n] = h
    right = np.append(np.zeros(2 * n), 0.5)
    sticks = np.ones(n, dtype=bool)
    while True:
        slides = np.flatnonzero(~sticks)
        A[n + slides] = 0.0
        A[n + slides, n + slides], A[n + slides, slides] = 1.0, -mu
        p, q = np.split(np.linalg.solve(A, right)[:-1], 2)
        over = sticks & (q > mu * p)
        if not over.any():
            break
        sticks &= ~over
    m = int(np.count_nonzero(sticks))
    if m < 2:
        raise ValueError(f"n = {n!r}: the stick zone is smaller than two cells; give more, or a larger mu")
    before, last = (1.0 - q[m - 2 : m] / (mu * p[m - 2 : m])) ** 2
    return float(x[m - 1] + last * (x[m - 1] - x[m - 2]) / (before - last))


# --- slip hardening of one point --------------------------------------------------------------------------------


@dataclass(frozen=True)
class MuConstant:
    """mu(kappa) = mu0 (-)."""

    mu0: float

    def __call__(self, kappa: float) -> float:
        """`kappa` (length) -> mu (-)."""
        return self.mu0

    def solve(self, drive: float, p: float, k_T: float) -> float:
        """`drive` (length), p (stress), k_T (stress/length) -> kappa (length): root of k_T kappa + mu p = k_T drive."""
        return drive - self.mu0 * p / k_T


@dataclass(frozen=True)
class MuLinear:
    """mu(kappa) = mu0 + slope kappa: mu0 (-), slope (1/length; negative softens)."""

    mu0: float
    slope: float

    def __call__(self, kappa: float) -> float:
        """`kappa` (length) -> mu (-)."""
        return self.mu0 + self.slope * kappa

    def solve(self, drive: float, p: float, k_T: float) -> float:
        """`drive` (length), p (stress), k_T (stress/length) -> kappa (length): root of k_T kappa + mu p = k_T drive."""
        return (k_T * drive - self.mu0 * p) / (k_T + self.slope * p)


@dataclass(frozen=True)
class MuExponential:
    """mu(kappa) = mu_inf - (mu_inf - mu0) exp(-kappa/u0): mu0, mu_inf (-), u0 (length)."""

    mu0: float
    mu_inf: float
    u0: float

    def __call__(self, kappa: float) -> float:
        """`kappa` (length) -> mu (-)."""
        return self.mu_inf - (self.mu_inf - self.mu0) * math.exp(-kappa / self.u0)

    def solve(self, drive: float, p: float, k_T: float) -> float:
        """`drive` (length), p (stress), k_T (stress/length) -> kappa (length): root of k_T kappa + mu p = k_T drive.

        kappa = A + u0 W((B/u0) exp(-A/u0)), A = drive - mu_inf p/k_T, B = (mu_inf - mu0) p/k_T. For hardening the
        same number is written with Wright's omega, which does not overflow.
        """
        from scipy.special import lambertw, wrightomega

        A = drive - self.mu_inf * p / k_T
        B = (self.mu_inf - self.mu0) * p / k_T
        if B == 0.0:
            return A
        if B > 0.0:
            return A + self.u0 * float(wrightomega(math.log(B / self.u0) - A / self.u0).real)
        return A + self.u0 * float(lambertw(B / self.u0 * math.exp(-A / self.u0)).real)


SlipLaw = MuConstant | MuLinear | MuExponential


def slip_hardening(u: ArrayLike, *, p: float, k_T: float, law: SlipLaw) -> tuple[Array, Array]:
    """`u` (n,) (length), p (stress), k_T (stress/length) -> t_T (n,) (stress), kappa (n,) (length): one sliding point.

    The displacement runs from zero through the values of u in a straight line from one to the next (repeat or
    reverse at will); pressure and stiffness are constant. Between two turns the direction is fixed and the state is
    exact: stick while |t_T| < mu(kappa) p, then, with s the direction and (t0, kappa0) the state before,
    k_T (kappa - kappa0) + mu(kappa) p = k_T |du| + s t0. kappa is the length of the slip path and never decreases, so
    mu does not recover on reversal. (Monotone: t_T + k_T kappa = k_T u.) Splitting a stroke does not change the
    answer.

    Raises ValueError for p < 0, k_T <= 0, coefficients of friction below 0, u0 <= 0, or a softening law with
    k_T <= |mu'| p (no unique answer) or one that falls below zero on this path.
    Source: the elastic-plastic analogy of the founding paper (its eqs. 9-23), with path length for net slip; Corless
    et al. (1996) for the Lambert W function.
    """
    not_negative(p=p)
    positive(k_T=k_T)
    _check_law(law, p, k_T)
    path = np.atleast_1d(np.asarray(u, dtype=float))
    t_T, kappa = np.zeros_like(path), np.zeros_like(path)
    t, slip, at = 0.0, 0.0, 0.0
    for i, target in enumerate(path):
        move = float(target) - at
        sign = math.copysign(1.0, move)
        trial = t + k_T * move
        if sign * trial > law(slip) * p:
            slip += max(0.0, law.solve(abs(move) + sign * t / k_T + slip, p, k_T) - slip)
            if law(slip) < 0.0:
                raise ValueError(f"law = {law!r}: mu falls below 0 at kappa = {slip!r}; shorten u or flatten the law")
            t = sign * law(slip) * p
        else:
            t = trial
        at = float(target)
        t_T[i], kappa[i] = t, slip
    return t_T, kappa


def _check_law(law: SlipLaw, p: float, k_T: float) -> None:
    """Raise ValueError for a law without meaning or without a unique answer at this pressure and stiffness."""
    not_negative(mu0=law.mu0)
    steepest = 0.0
    if isinstance(law, MuLinear):
        steepest = law.slope
    elif isinstance(law, MuExponential):
        not_negative(mu_inf=law.mu_inf)
        positive(u0=law.u0)
        steepest = (law.mu_inf - law.mu0) / law.u0
    if k_T + min(steepest, 0.0) * p <= 0.0:
        raise ValueError(f"k_T = {k_T!r}: softening needs k_T > |mu'| p = {-steepest * p!r}; raise k_T")


# --- elementary ---------------------------------------------------------------------------------------------------


def sliding_wedge(alpha: float, mu: float) -> float:
    """`alpha` (rad), mu (-) -> F/G (-): horizontal force per weight that pushes a body up an incline.

    (tan alpha + mu)/(1 - mu tan alpha) = tan(alpha + atan mu); 0.412371 for atan 0.1 and mu = 0.3.
    Raises ValueError for mu < 0, alpha outside (-pi/2, pi/2), or where the body jams (mu tan alpha >= 1).
    Source: NAFEMS benchmark CGS-4; statics.
    """
    not_negative(mu=mu)
    if not abs(alpha) < 0.5 * math.pi:
        raise ValueError(f"alpha = {alpha!r}: angle in radians between -pi/2 and pi/2; convert degrees with radians()")
    slope = math.tan(alpha)
    if mu * slope >= 1.0:
        raise ValueError(f"mu = {mu!r}: the body jams for mu tan(alpha) >= 1; lower mu or alpha = {alpha!r}")
    return (slope + mu) / (1.0 - mu * slope)


def circular_path_lag(*, mu: float, p: float, k_T: float, rho: float) -> float:
    """`mu` (-), p (stress), k_T (stress/length), rho (length) -> phi (rad): steady lag of friction on a circular path.

    A point driven round a circle of radius rho drags its slider on a string of elastic length mu p/k_T; in the steady
    state the string is tangent to the slider's own circle, hence sin phi = mu p/(k_T rho), phi the angle between the
    traction and the direction of motion.
    Raises ValueError for mu or p < 0, k_T or rho <= 0, or mu p/k_T >= rho (the slider stops: the point only sticks).
    Source: the circular tractrix (pursuit curve), with the slider of the elastic-plastic analogy.
    """
    not_negative(mu=mu, p=p)
    positive(k_T=k_T, rho=rho)
    sine = mu * p / (k_T * rho)
    if sine >= 1.0:
        raise ValueError(f"rho = {rho!r}: not above mu p/k_T = {mu * p / k_T!r}, nothing slides; give a larger rho")
    return math.asin(sine)


def capstan(T1: float, mu: float, angle: float) -> float:
    """T1 (force), mu (-), angle (rad, wrapped) -> T2 (force): rope or strip drawn over a drum, T2 = T1 e^(mu angle).

    Raises ValueError for a negative T1, mu or angle.
    Source: Euler (1769), Eytelwein (1808).
    """
    not_negative(T1=T1, mu=mu, angle=angle)
    return T1 * math.exp(mu * angle)


def wanheim_bay(p: float, k: float, f: float) -> float:
    """p, k (stress), f (-) -> tau (stress): friction by the real area of contact of Wanheim & Bay.

    In terms of sigma0 = sqrt(3) k: proportional up to p'/sigma0 = [1 + pi/2 + arccos f + sqrt(1 - f^2)] /
    {sqrt(3) [1 + sqrt(1 - f)]}, where tau'/k = 1 - sqrt(1 - f); beyond, the exponential through (p', tau') with the
    same slope that ends at f k.
    Raises ValueError for a negative p, a k not above 0 or an f outside [0, 1].
    Source: Bay (1987), J. Mech. Working Technol. 14, 203-223.
    """
    not_negative(p=p)
    positive(k=k)
    if not 0.0 <= f <= 1.0:
        raise ValueError(f"f = {f!r}: a friction factor lies in [0, 1]; give a value in that range")
    root = math.sqrt(1.0 - f)
    x = p / (math.sqrt(3.0) * k)
    limit = (1.0 + 0.5 * math.pi + math.acos(f) + math.sqrt(1.0 - f * f)) / (math.sqrt(3.0) * (1.0 + root))
    reached = 1.0 - root
    if x <= limit or reached >= f:
        return k * reached * min(x / limit, 1.0)
    return k * (reached + (f - reached) * (1.0 - math.exp((limit - x) * reached / ((f - reached) * limit))))


def levanov(p: float, sigma: float, m: float) -> float:
    """Pressure p, flow stress sigma (stress), m (-) -> tau (stress) = m (sigma/sqrt 3) [1 - exp(-1.25 p/sigma)].

    Raises ValueError for a negative p or m, or a sigma not above 0.
    Source: Levanov, Kolmogorov, Burkin et al. (1976), Contact Friction in Metal Forming (in Russian).
    """
    not_negative(p=p, m=m)
    positive(sigma=sigma)
    return m * sigma / math.sqrt(3.0) * (1.0 - math.exp(-1.25 * p / sigma))


def smooth_cap(p: float, k: float, mu: float, m: float, n: float) -> float:
    """p, k (stress), mu, m, n (-) -> tau (stress) = m k {1 - exp[-(mu p/(m k))^n]}^(1/n): Coulomb rounded off to m k.

    Raises ValueError for a negative p, or k, mu, m or n not above 0.
    Source: Shirakashi & Usui (1973) with n = 1; Childs, Maekawa, Obikawa & Yamane (2000), Metal Machining, section 2.4.
    """
    not_negative(p=p)
    positive(k=k, mu=mu, m=m, n=n)
    return m * k * float((-math.expm1(-((mu * p / (m * k)) ** n))) ** (1.0 / n))


def stribeck(v: float, *, static: float, kinetic: float, speed: float, n: float = 2.0, viscous: float = 0.0) -> float:
    """v, speed (length/time), static, kinetic, n (-), viscous (time/length) -> mu (-) at a sliding speed v.

    mu = kinetic + (static - kinetic) exp[-(v/speed)^n] + viscous v.
    Raises ValueError for a negative v or a speed not above 0.
    Source: Bo & Pavelescu (1982), Wear 82, 277-289; Armstrong-Helouvry et al. (1994), Automatica 30, 1083-1138.
    """
    not_negative(v=v)
    positive(speed=speed)
    return kinetic + (static - kinetic) * math.exp(-math.pow(v / speed, n)) + viscous * v


def wang_osakada(mu: float, theta: float = 0.0) -> tuple[float, float]:
    """`mu` (-), theta (rad, inclination of the tool) -> m (-), p_cr/Y (-): shear factor, pressure where it begins.

    Coulomb below p_cr, then the constant shear m Y/sqrt(3) with m = sqrt(3) mu (a mu + b),
    a = -0.48 theta^2 + 2.48 theta - 3.82, b = -1.19 theta + 3.0, and
    p_cr/Y = (2/sqrt 3) [(1 + sin 2 phi)/2 + pi/4 + phi - theta], phi = acos(m)/2.
    For theta = 0 and mu = 0.1: 0.4534 and 2.634.
    Raises ValueError for mu < 0 or a mu beyond the fit (m above 1, or falling as mu grows).
    Source: Wang & Osakada, friction law for metal forming (dry contact, slip-line fields).
    """
    not_negative(mu=mu)
    a = -0.48 * theta * theta + 2.48 * theta - 3.82
    b = -1.19 * theta + 3.0
    m = math.sqrt(3.0) * mu * (a * mu + b)
    if not 0.0 <= m <= 1.0 or mu > -0.5 * b / a:
        raise ValueError(f"mu = {mu!r}: the fit of m = {m:.4g} ends before it at theta = {theta!r}; lower mu")
    phi = 0.5 * math.acos(m)
    p_cr = 2.0 / math.sqrt(3.0) * (0.5 * (1.0 + math.sin(2.0 * phi)) + 0.25 * math.pi + phi - theta)
    return m, p_cr
