// SPDX-License-Identifier: GPL-2.0-only
/*
 * Counters that behave as those of several drivers, for tests. Writing `count` turns the encoder:
 * the device shows what is written, wrapped at its ceiling.
 *
 * rig-eqep      ceiling 0 after a reset, so that the count stays 0
 * rig-intel     refuses everything but `enable` while it is enabled
 * rig-plain     16 bits and no ceiling
 * rig-fixed     counts edges of one line and does not let that be changed
 */
#include <linux/counter.h>
#include <linux/module.h>
#include <linux/platform_device.h>

enum rig_kind { RIG_EQEP, RIG_INTEL, RIG_PLAIN, RIG_FIXED, RIG_KINDS };

struct rig {
	enum rig_kind kind;
	enum counter_function function;
	u64 count;
	u64 ceiling;
	u64 preset;
	u8 enable;
	u8 preset_enable;
};

static const char *const rig_names[] = { "rig-eqep", "rig-intel", "rig-plain", "rig-fixed" };

static struct rig *rig_of(struct counter_device *counter)
{
	return counter_priv(counter);
}

static int rig_busy(struct counter_device *counter)
{
	return rig_of(counter)->kind == RIG_INTEL && rig_of(counter)->enable ? -EBUSY : 0;
}

static int rig_count_read(struct counter_device *counter, struct counter_count *count, u64 *value)
{
	struct rig *rig = rig_of(counter);

	switch (rig->kind) {
	case RIG_PLAIN:
		*value = rig->count & 0xffff;
		break;
	case RIG_FIXED:
		*value = rig->count;
		break;
	default: /* the ceilings of these tests are 0 or one below a power of two */
		*value = rig->count & rig->ceiling;
	}
	return 0;
}

static int rig_count_write(struct counter_device *counter, struct counter_count *count, u64 value)
{
	rig_of(counter)->count = value;
	return 0;
}

static int rig_function_read(struct counter_device *counter, struct counter_count *count,
			     enum counter_function *function)
{
	*function = rig_of(counter)->function;
	return 0;
}

static int rig_function_write(struct counter_device *counter, struct counter_count *count,
			      enum counter_function function)
{
	if (rig_busy(counter))
		return -EBUSY;
	rig_of(counter)->function = function;
	return 0;
}

#define RIG_ATTRIBUTE(name, type, allowed)                                                       \
	static int rig_##name##_read(struct counter_device *counter, struct counter_count *count, \
				     type *value)                                                 \
	{                                                                                         \
		*value = rig_of(counter)->name;                                                   \
		return 0;                                                                         \
	}                                                                                         \
	static int rig_##name##_write(struct counter_device *counter,                             \
				      struct counter_count *count, type value)                    \
	{                                                                                         \
		int refusal = allowed;                                                            \
                                                                                                  \
		if (refusal)                                                                      \
			return refusal;                                                           \
		rig_of(counter)->name = value;                                                    \
		return 0;                                                                         \
	}

RIG_ATTRIBUTE(enable, u8, 0)
RIG_ATTRIBUTE(ceiling, u64, value > U32_MAX ? -ERANGE : rig_busy(counter))
RIG_ATTRIBUTE(preset, u64, rig_busy(counter))
RIG_ATTRIBUTE(preset_enable, u8, rig_busy(counter))

static struct counter_comp rig_attributes[] = {
	COUNTER_COMP_ENABLE(rig_enable_read, rig_enable_write),
	COUNTER_COMP_CEILING(rig_ceiling_read, rig_ceiling_write),
	COUNTER_COMP_PRESET(rig_preset_read, rig_preset_write),
	COUNTER_COMP_PRESET_ENABLE(rig_preset_enable_read, rig_preset_enable_write),
};

static const enum counter_function rig_functions[] = {
	COUNTER_FUNCTION_INCREASE,
	COUNTER_FUNCTION_QUADRATURE_X4,
};

static const enum counter_synapse_action rig_actions[] = { COUNTER_SYNAPSE_ACTION_BOTH_EDGES };
static struct counter_signal rig_signals[] = { { .id = 0, .name = "A" } };
static struct counter_synapse rig_synapses[] = {
	{ .actions_list = rig_actions, .num_actions = 1, .signal = rig_signals },
};

static int rig_action_read(struct counter_device *counter, struct counter_count *count,
			   struct counter_synapse *synapse, enum counter_synapse_action *action)
{
	*action = COUNTER_SYNAPSE_ACTION_BOTH_EDGES;
	return 0;
}

#define RIG_COUNT(extensions, number)                                                        \
	{                                                                                    \
		.id = 0, .name = "turn", .functions_list = rig_functions,                    \
		.num_functions = ARRAY_SIZE(rig_functions), .synapses = rig_synapses,        \
		.num_synapses = 1, .ext = extensions, .num_ext = number,                     \
	}

static struct counter_count rig_counts[RIG_KINDS][1] = {
	{ RIG_COUNT(rig_attributes, ARRAY_SIZE(rig_attributes)) },
	{ RIG_COUNT(rig_attributes, ARRAY_SIZE(rig_attributes)) },
	{ RIG_COUNT(rig_attributes, 1) },
	{ RIG_COUNT(rig_attributes, 1) },
};

static const struct counter_ops rig_ops = {
	.count_read = rig_count_read,
	.count_write = rig_count_write,
	.function_read = rig_function_read,
	.function_write = rig_function_write,
	.action_read = rig_action_read,
};

static const struct counter_ops rig_fixed_ops = {
	.count_read = rig_count_read,
	.count_write = rig_count_write,
	.function_read = rig_function_read,
	.action_read = rig_action_read,
};

static struct platform_device *rig_parents[RIG_KINDS];
static struct counter_device *rig_counters[RIG_KINDS];

static int rig_add(enum rig_kind kind)
{
	struct platform_device *parent =
		platform_device_register_simple(rig_names[kind], PLATFORM_DEVID_NONE, NULL, 0);
	struct counter_device *counter;
	struct rig *rig;
	int error;

	if (IS_ERR(parent))
		return PTR_ERR(parent);
	rig_parents[kind] = parent;
	counter = counter_alloc(sizeof(*rig));
	if (!counter)
		return -ENOMEM;
	rig = counter_priv(counter);
	rig->kind = kind;
	rig->ceiling = kind == RIG_INTEL ? U32_MAX : 0;
	rig->enable = kind == RIG_INTEL;
	counter->name = rig_names[kind];
	counter->parent = &parent->dev;
	counter->ops = kind == RIG_FIXED ? &rig_fixed_ops : &rig_ops;
	counter->signals = rig_signals;
	counter->num_signals = 1;
	counter->counts = rig_counts[kind];
	counter->num_counts = 1;
	error = counter_add(counter);
	if (error) {
		counter_put(counter);
		return error;
	}
	rig_counters[kind] = counter;
	return 0;
}

static void rig_remove_all(void)
{
	int kind;

	for (kind = 0; kind < RIG_KINDS; kind++) {
		if (rig_counters[kind]) {
			counter_unregister(rig_counters[kind]);
			counter_put(rig_counters[kind]);
		}
		if (rig_parents[kind])
			platform_device_unregister(rig_parents[kind]);
	}
}

static int __init rig_init(void)
{
	int kind, error;

	for (kind = 0; kind < RIG_KINDS; kind++) {
		error = rig_add(kind);
		if (error) {
			rig_remove_all();
			return error;
		}
	}
	return 0;
}

module_init(rig_init);
module_exit(rig_remove_all);
MODULE_DESCRIPTION("Counters as those of several drivers, for tests");
MODULE_LICENSE("GPL");
MODULE_IMPORT_NS(COUNTER);
