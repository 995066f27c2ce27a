// SPDX-License-Identifier: GPL-2.0-only
/*
 * An I2C adapter whose transfers are answered by a process.
 *
 * Reading /dev/rig_i2c waits for a transfer and returns it: the number of messages (32 bit), then
 * for each message address, flags, length and zero (16 bit each), then the bytes of the messages
 * that write. Writing answers it: the result (32 bit, signed: messages done, or minus an errno),
 * then the bytes of the messages that read. All in the byte order of the machine.
 */
#include <linux/i2c.h>
#include <linux/miscdevice.h>
#include <linux/module.h>
#include <linux/mutex.h>
#include <linux/poll.h>
#include <linux/uaccess.h>
#include <linux/wait.h>

#define ANSWER_TIMEOUT (2 * HZ)

static bool smbus_only;
module_param(smbus_only, bool, 0644);
MODULE_PARM_DESC(smbus_only, "say that the adapter does SMBus commands only");

static struct i2c_adapter_quirks rig_quirks;
module_param_named(max_read, rig_quirks.max_read_len, ushort, 0644);
MODULE_PARM_DESC(max_read, "bytes that the adapter reads at most in one message; 0 for any");

enum rig_state { RIG_IDLE, RIG_ASKED, RIG_TAKEN, RIG_ANSWERED };

static DEFINE_MUTEX(rig_lock); /* of everything below */
static DECLARE_WAIT_QUEUE_HEAD(rig_wait);
static enum rig_state rig_state;
static struct i2c_msg *rig_msgs;
static int rig_num;
static int rig_result;

static int rig_xfer(struct i2c_adapter *adapter, struct i2c_msg *msgs, int num)
{
	int result;

	mutex_lock(&rig_lock);
	rig_msgs = msgs;
	rig_num = num;
	rig_state = RIG_ASKED;
	mutex_unlock(&rig_lock);
	wake_up_all(&rig_wait);
	wait_event_timeout(rig_wait, READ_ONCE(rig_state) == RIG_ANSWERED, ANSWER_TIMEOUT);
	mutex_lock(&rig_lock);
	result = rig_state == RIG_ANSWERED ? rig_result : -ETIMEDOUT;
	rig_state = RIG_IDLE;
	rig_msgs = NULL;
	mutex_unlock(&rig_lock);
	return result;
}

static u32 rig_functionality(struct i2c_adapter *adapter)
{
	return smbus_only ? I2C_FUNC_SMBUS_BYTE_DATA : I2C_FUNC_I2C | I2C_FUNC_SMBUS_EMUL;
}

static const struct i2c_algorithm rig_algorithm = {
	.master_xfer = rig_xfer,
	.functionality = rig_functionality,
};

static struct i2c_adapter rig_adapter = {
	.owner = THIS_MODULE,
	.name = "rig",
	.algo = &rig_algorithm,
	.quirks = &rig_quirks,
};

/* Copies to the user and moves on; false where there is no room. */
static bool rig_put(char __user **to, size_t *room, const void *from, size_t size)
{
	if (size > *room || copy_to_user(*to, from, size))
		return false;
	*to += size;
	*room -= size;
	return true;
}

static ssize_t rig_read(struct file *file, char __user *to, size_t room, loff_t *offset)
{
	char __user *begin = to;
	ssize_t done = -EAGAIN;
	u32 num;
	int i;

	if (file->f_flags & O_NONBLOCK) {
		if (READ_ONCE(rig_state) != RIG_ASKED)
			return -EAGAIN;
	} else if (wait_event_interruptible(rig_wait, READ_ONCE(rig_state) == RIG_ASKED)) {
		return -ERESTARTSYS;
	}
	mutex_lock(&rig_lock);
	if (rig_state != RIG_ASKED)
		goto out;
	done = -EMSGSIZE;
	num = rig_num;
	if (!rig_put(&to, &room, &num, sizeof(num)))
		goto out;
	for (i = 0; i < rig_num; i++) {
		u16 head[4] = { rig_msgs[i].addr, rig_msgs[i].flags, rig_msgs[i].len, 0 };

		if (!rig_put(&to, &room, head, sizeof(head)))
			goto out;
	}
	for (i = 0; i < rig_num; i++)
		if (!(rig_msgs[i].flags & I2C_M_RD) &&
		    !rig_put(&to, &room, rig_msgs[i].buf, rig_msgs[i].len))
			goto out;
	rig_state = RIG_TAKEN;
	done = to - begin;
out:
	mutex_unlock(&rig_lock);
	return done;
}

static ssize_t rig_write(struct file *file, const char __user *from, size_t size, loff_t *offset)
{
	const char __user *at = from;
	ssize_t done = -EINVAL;
	s32 result;
	int i;

	if (size < sizeof(result) || copy_from_user(&result, at, sizeof(result)))
		return -EINVAL;
	at += sizeof(result);
	mutex_lock(&rig_lock);
	if (rig_state != RIG_TAKEN)
		goto out; /* the transfer was given up meanwhile */
	for (i = 0; i < rig_num && i < result; i++) {
		size_t length = rig_msgs[i].len;

		if (!(rig_msgs[i].flags & I2C_M_RD))
			continue;
		if (at + length > from + size || copy_from_user(rig_msgs[i].buf, at, length))
			goto out;
		at += length;
	}
	rig_result = result;
	WRITE_ONCE(rig_state, RIG_ANSWERED);
	done = size;
out:
	mutex_unlock(&rig_lock);
	wake_up_all(&rig_wait);
	return done;
}

static __poll_t rig_poll(struct file *file, poll_table *table)
{
	poll_wait(file, &rig_wait, table);
	return READ_ONCE(rig_state) == RIG_ASKED ? EPOLLIN | EPOLLRDNORM : 0;
}

static const struct file_operations rig_operations = {
	.owner = THIS_MODULE,
	.read = rig_read,
	.write = rig_write,
	.poll = rig_poll,
};

static struct miscdevice rig_device = {
	.minor = MISC_DYNAMIC_MINOR,
	.name = "rig_i2c",
	.fops = &rig_operations,
};

static int __init rig_init(void)
{
	int error = misc_register(&rig_device);

	if (error)
		return error;
	error = i2c_add_adapter(&rig_adapter);
	if (error)
		misc_deregister(&rig_device);
	return error;
}

static void __exit rig_exit(void)
{
	i2c_del_adapter(&rig_adapter);
	misc_deregister(&rig_device);
}

module_init(rig_init);
module_exit(rig_exit);
MODULE_DESCRIPTION("I2C adapter answered by a process, for tests");
MODULE_LICENSE("GPL");
