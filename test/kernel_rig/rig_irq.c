// SPDX-License-Identifier: GPL-2.0-only
/*
 * User-Mode Linux takes all its interrupt numbers at the start, so that gpio-sim finds none for its
 * lines. This gives the upper half of them back.
 */
#include <linux/irq.h>
#include <linux/module.h>

#define FIRST 32

static int __init rig_init(void)
{
	irq_free_descs(FIRST, NR_IRQS - FIRST);
	return 0;
}

module_init(rig_init);
MODULE_DESCRIPTION("Free interrupt numbers for gpio-sim, for tests");
MODULE_LICENSE("GPL");
