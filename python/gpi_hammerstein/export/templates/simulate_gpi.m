function [y, v] = simulate_gpi(model, u, covariates)
% SIMULATE_GPI  Simulate a model that `gpi export --mat` has written, in MATLAB or GNU Octave.
%
%   y = simulate_gpi('model.mat', u)
%   y = simulate_gpi(model, u, covariates)
%   [y, v] = simulate_gpi(...)
%
%   model       the name of the file, or the structure `gpi` in it
%   u           the input, (samples, inputs), sampled at model.rate Hz, in model.input_units
%   covariates  the columns model.covariates, (samples, columns), if effects of the model read them
%   y           the output, (samples, outputs), in model.output_units
%   v           the signal between the hysteresis and the dynamics, (samples, inputs)
%
%   The simulation begins in the steady state at the first input, as model.simulate of Python:
%
%       y = H(G P[D[I(u)]] + d) + e + offset
%
%   with the input stage I, the deadzones D, the plays P, the dynamics G with what acts in parallel or in loops
%   around them, the output stage H, and the signals d and e that are added before and after it.

    if ~isstruct(model)
        loaded = load(model, 'gpi');
        model = loaded.gpi;
    end
    inputs = numel(model.hysteresis);
    if isvector(u) && inputs == 1
        u = u(:);
    end
    if isempty(u) || size(u, 2) ~= inputs
        error('simulate_gpi:input', 'u has %d columns and %d samples; the model has %d inputs.', ...
              size(u, 2), size(u, 1), inputs);
    end
    samples = size(u, 1);
    if nargin < 3
        covariates = zeros(samples, 0);
    end
    needed = numel(model.covariates);
    if needed > 0 && any(size(covariates) ~= [samples, needed])
        error('simulate_gpi:covariates', 'The model needs the covariates %s: %d columns of %d samples.', ...
              strjoin(model.covariates(:)', ', '), needed, samples);
    end

    drive = u;
    for own = at(model, 'input')
        c = own{1}.channel;
        drive(:, c) = input_stage(own{1}, drive(:, c));
    end
    v = zeros(samples, inputs);
    standing = zeros(1, inputs);
    for c = 1:inputs
        [v(:, c), standing(c)] = hysteresis(model, c, drive(:, c));
    end
    y = dynamics(model, v, standing);
    for own = [at(model, 'displaced'), at(model, 'output'), at(model, 'added')]
        c = own{1}.channel;
        y(:, c) = reading(own{1}, y(:, c), covariates);
    end
    y = y + repmat(model.offsets(:)', samples, 1);
end

function found = at(model, place)
% The operations at a place of the chain, in their order.
    operations = model.operations(:)';
    found = operations(cellfun(@(own) strcmp(own.place, place), operations));
end

function u = input_stage(own, u)
    switch own.kind
        case 'delay'
            whole = own.last - 1;
            later = @(n) [repmat(u(1), min(n, numel(u)), 1); u(1:end-n)];
            u = (1 - own.part) * later(whole) + own.part * later(whole + 1);
        case 'slew'
            for k = 2:numel(u)
                u(k) = u(k-1) + max(-own.reach, min(own.reach, u(k) - u(k-1)));
            end
        otherwise
            unknown(own);
    end
end

function [v, standing] = hysteresis(model, channel, u)
% v of one input, and its value for a constant u that was raised from zero to the first one.
    bank = model.hysteresis{channel};
    first = envelope(bank, u(1), 0);
    z = envelope(bank, u, [u(1); u(1:end-1)]);
    r = bank.half_widths(:)';
    place = min(first + r, max(first - r, 0));
    standing = contribution(model, channel, bank, place);

    widths = repmat(r, numel(u), 1);
    for own = at(model, 'widths')
        if own{1}.channel == channel
            speed = growth(own{1}, [0; abs(diff(u))] * model.rate);
            wider = widths .* (1 + own{1}.relative * repmat(speed, 1, numel(r))) ...
                    + own{1}.absolute * repmat(speed, 1, numel(r));
            widths = max(wider, 0) .* (widths > 0);
        end
    end
    places = zeros(numel(u), numel(r));
    for k = 1:numel(u)
        place = max(z(k) - widths(k, :), min(z(k) + widths(k, :), place));
        places(k, :) = place;
    end
    v = contribution(model, channel, bank, places);
end

function z = envelope(bank, u, before)
% The sum of deadzones.
    z = zeros(size(u));
    for j = 1:numel(bank.thresholds)
        eta = bank.thresholds(j);
        if strcmp(bank.reading, 'directional')
            zone = (u - eta) .* (u > before & u > eta) + (u + eta) .* (u < before & u < -eta);
        elseif eta > 0
            zone = max(u - eta, 0);
        elseif eta < 0
            zone = min(u - eta, 0);
        else
            zone = u;
        end
        z = z + bank.deadzone_weights(j) * zone;
    end
end

function g = growth(own, speed)
% What half-widths grow with: the speed, or its transformation of Box and Cox behind a lag.
    g = speed;
    if isfield(own, 'exponent')
        seen = filter(own.share, [1, own.share - 1], speed);
        if own.exponent == 0
            g = own.knee * log1p(seen / own.knee);
        else
            g = own.knee * expm1(own.exponent * log1p(seen / own.knee)) / own.exponent;
        end
    end
end

function v = contribution(model, channel, bank, places)
% The weighted sum of plays, read through curves if an effect has some.
    for own = at(model, 'curves')
        if own{1}.channel == channel
            places = curved(own{1}, places);
        end
    end
    v = places * bank.weights(:);
end

function places = curved(own, places)
    f = max(-1, min(1, (places - own.middle) / own.scale));
    lower = ones(size(f));
    legendre_a = f;
    for a = 1:own.degrees
        upper = ((2 * a + 1) * f .* legendre_a - a * lower) / (a + 1);
        factors = own.rows(:, a)';
        places = places + own.scale * repmat(factors, size(f, 1), 1) .* (upper - lower) / (2 * a + 1);
        lower = legendre_a;
        legendre_a = upper;
    end
end

function y = dynamics(model, v, standing)
% The displacement: the state space, sections in parallel with it, and loops around it.
    samples = size(v, 1);
    y = zeros(samples, size(model.D, 1));
    for own = at(model, 'parallel')
        c = own{1}.channel;
        late = min(own{1}.late, samples);
        deviation = [zeros(late, 1); v(1:end-late, c) - standing(c)];
        y(:, 1) = y(:, 1) + section(own{1}, deviation, standing(c));
    end
    beside = y;
    has_steps = ~isempty(model.steps);
    loops = at(model, 'loops');
    places = cellfun(@(own) zeros(own.memory, 1), loops, 'UniformOutput', false);
    x = model.steady * standing(:);
    for k = 1:samples
        now = v(k, :)';
        if has_steps && k > 1
            [x, places] = settled(model, loops, places, x, now, before, beside(k - 1, :));
        end
        before = [x; now];
        seen = y(k, :)' + model.C * x + model.D * now;
        y(k, :) = seen';
        next = model.A * x + model.B * now;
        if ~has_steps
            for i = 1:numel(loops)
                own = loops{i};
                signal = seen(own.channel);
                if isfield(own, 'seen')
                    signal = own.seen(:)' * [x; now];
                end
                [force, places{i}] = law(own, signal, places{i});
                next = next + own.drives(:) * force;
            end
        end
        x = next;
    end
end

function [x, places] = settled(model, loops, places, x, now, before, beside)
% The states behind loops that take several steps from the sample before, (x; v) = before, to this one.
    forces = zeros(0, 1);
    ahead = [x; now];
    for i = 1:numel(model.steps)
        step = model.steps{i};
        own = loops{step.loop};
        signal = step.seen(:)' * before + step.ahead(:)' * ahead + step.earlier(:)' * forces;
        if ~isfield(own, 'seen')
            signal = signal + beside(own.channel);
        end
        [forces(i, 1), places{step.loop}] = law(own, signal, places{step.loop});
    end
    for i = 1:numel(model.steps)
        x = x + model.steps{i}.drives(:) * forces(i);
    end
end

function y = section(own, deviation, standing)
    switch own.kind
        case 'lags'
            y = sum(own.gains) * standing;
            for i = 1:numel(own.gains)
                y = y + own.gains(i) * filter([0, own.shares(i)], [1, own.shares(i) - 1], deviation);
            end
        case 'section'
            denominator = [1, own.a1, own.a2];
            y = standing * (own.b1 + own.b2) / sum(denominator) ...
                + filter([0, own.b1, own.b2], denominator, deviation);
        otherwise
            unknown(own);
    end
end

function [force, places] = law(own, signal, places)
    switch own.kind
        case 'power'
            force = own.scale * (signal / own.scale) ^ own.exponent;
        case 'stops'
            places = max(signal - own.half_widths(:), min(signal + own.half_widths(:), places));
            force = own.weights(:)' * (signal - places);
        case 'bouc_wen'
            before = places(2);
            slope = (3 * signal - 4 * before + places(3)) / 2;
            curvature = signal - 2 * before + places(3);
            turn = before;
            if slope * curvature > 0 && slope ^ 2 < curvature ^ 2
                turn = signal - slope ^ 2 / curvature / 2;
            end
            force = changed(own, places(1), turn - before);
            force = changed(own, force, signal - turn);
            places = [force; signal; before];
        case 'dahl'
            [last, before] = deal(places(1), places(2));
            slope = (3 * signal - 4 * before + places(3)) / 2;
            curvature = signal - 2 * before + places(3);
            if slope * curvature > 0 && slope ^ 2 < curvature ^ 2
                turn = signal - slope ^ 2 / curvature / 2;
                [turned, average] = slid(own, last, turn - before);
                [friction, rest] = slid(own, turned, signal - turn);
                average = average + (rest - average) * slope / curvature;
            else
                [friction, average] = slid(own, last, signal - before);
            end
            force = friction;
            if own.averaged > 0
                force = average + friction - last;
            end
            places = [friction; signal; before];
        case 'speed'
            force = own.pace * abs(signal - places);
            places = signal;
        case 'damping'
            force = own.scale * tanh(own.pace * (signal - places) / own.scale);
            places = signal;
        otherwise
            unknown(own);
    end
end

function [f, average] = slid(own, f, dz)
    % friction behind a change of z in one direction, df = (dz - |dz| f) / distance, and its mean over the change
    direction = 1 - 2 * (dz < 0);
    x = abs(dz) / own.distance;
    lost = -expm1(-x);
    part = 1 - x * (0.5 - x / 6);
    if x > 1e-4
        part = lost / x;
    end
    average = direction + (f - direction) * part;
    f = f + (direction - f) * lost;
end

function w = changed(own, w, dz)
    % the force w behind a change of z in one direction: dw = dz - (beta |dz| w + gamma dz |w|) |w|^(exponent - 1)
    nodes = [0.000394223874247, 0.010336130351846, 0.056279873509952, 0.166694745769052, ...
        0.350129388264702, 0.581812283426281, 0.807002607765473, 0.960684080371783];
    shares = [0.002009899851318, 0.022608759545903, 0.074421818131456, 0.148077506617691, ...
        0.214606276760671, 0.239284827746431, 0.199772274907471, 0.099218636439059];
    direction = 1 - 2 * (dz < 0);
    distance = abs(dz);
    size_of = w * direction;
    if size_of < 0
        k = own.beta - own.gamma;
        size_of = -size_of;
        to_zero = distance;
        if 1 + k * size_of ^ own.exponent > 0
            to_zero = sum(size_of * shares ./ (1 + k * (size_of * nodes) .^ own.exponent));
        end
        if to_zero >= distance
            w = -direction * grown(own, size_of, distance, k, -1);
            return
        end
        distance = distance - to_zero;
        size_of = 0;
    end
    w = direction * grown(own, size_of, distance, own.beta + own.gamma, 1);
end

function g = grown(own, g, distance, k, direction)
    most = max(g, g + direction * distance);
    stiff = 20 * abs(own.exponent * k * distance * most ^ (own.exponent - 1));
    steps = min(floor(stiff), 99) + 3;
    slope = @(x) direction - k * max(x, 0) ^ own.exponent;
    for n = 1:steps
        % shortest near zero, where the power bends
        part = n - 1;
        if direction < 0
            part = steps - n;
        end
        h = distance * (2 * part + 1) / steps ^ 2;
        first = slope(g);
        second = slope(g + h / 2 * first);
        third = slope(g + h / 2 * second);
        last = slope(g + h * third);
        g = g + h / 6 * (first + 2 * (second + third) + last);
    end
end

function y = reading(own, y, covariates)
    k = (0:numel(y)-1)';
    switch own.kind
        case 'polynomial'
            x = (y - own.middle) / own.scale;
            for m = 1:numel(own.coefficients)
                y = y + own.scale * own.coefficients(m) * x .^ (m + 1);
            end
        case 'no_less'
            y = max(y, own.lowest);
        case 'no_more'
            y = min(y, own.highest);
        case 'scaled'
            y = y .* (1 + at_knots(own, k));
        case 'backlash'
            place = 0;
            for i = 1:numel(y)
                place = max(y(i) - own.half_width, min(y(i) + own.half_width, place));
                y(i) = place;
            end
        case 'gap'
            y = y - own.missing * max(-own.half_width, min(own.half_width, y));
        case 'at_knots'
            y = y + at_knots(own, k);
        case 'sinusoid'
            phase = 2 * pi * mod(own.turns * k, 1);
            y = y + own.cosine * cos(phase) + own.sine * sin(phase);
        case 'leak'
            x = covariates(:, own.column);
            past = x(1) + own.start * (1 - own.share) .^ (k + 1);
            y = y + own.gain * (past + filter(own.share, [1, own.share - 1], x - x(1)));
        otherwise
            unknown(own);
    end
end

function d = at_knots(own, k)
% A function of time that is zero at the start: the cubic of Catmull and Rom through its later knots.
    values = [0; own.changes(:)];
    last = numel(values) - 1;
    if last == 0
        d = zeros(size(k));
        return
    end
    if last == 1
        ends = [2 * values(1) - values(2), 2 * values(2) - values(1)];
    else
        ends = [3 * values(1) - 3 * values(2) + values(3), 3 * values(end) - 3 * values(end-1) + values(end-2)];
    end
    values = [ends(1); values; ends(2)];
    place = min(k * own.pace, last);
    left = min(floor(place), last - 1);
    t = place - left;
    [a, b, c, e] = deal(values(left + 1), values(left + 2), values(left + 3), values(left + 4));
    d = b + 0.5 * t .* (c - a + t .* (2 * a - 5 * b + 4 * c - e + t .* (3 * (b - c) + e - a)));
end

function unknown(own)
    error('simulate_gpi:operation', 'This script does not know the operation %s; export both files again.', own.kind);
end
